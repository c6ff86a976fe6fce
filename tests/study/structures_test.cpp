// SPDX-License-Identifier: BSD-3-Clause
// Structures without a name: what the study says of shapes that no form of the catalogue has.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "core/study/findings/study.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/study_worlds/oracle.hpp"

namespace structures {
namespace {

using namespace backwash;
using namespace backwash::study;
using study_worlds::HiddenStructure;
using Hides = HiddenStructure::Kind;
using Quantity = HiddenStructure::Quantity;
using Where = HiddenStructure::Where;

std::filesystem::path own_folder() {
  return std::filesystem::temp_directory_path() / ("study-structures-" + std::to_string(::getpid()));
}

struct Seen {
  Observations observations;
  double explained;
};

Seen world_with(const HiddenStructure& structure, double size, std::uint64_t seed = 4711) {
  auto world = study_worlds::draw_world({seed, {"unknown"}, size, 12, ""});
  world.effects.structure = structure;
  const auto flights = study_worlds::fly_all(world);
  Seen seen{study_worlds::observe(world, flights, own_folder()), 0};
  seen.explained = study_worlds::explained(seen.observations, flights);
  std::filesystem::remove_all(own_folder());
  return seen;
}

Observations quiet(std::uint64_t seed = 4711) {
  auto seen = study_worlds::observe(study_worlds::draw_world({seed, {}, 1, 12, ""}), own_folder());
  std::filesystem::remove_all(own_folder());
  return seen;
}

StudyResult studied(const Observations& seen) {
  StudyOptions options;
  options.minimum_detectable = false;
  return backwash::study::study(seen, options);
}

TEST(Structures, AGustOfOneFrequencyCommonToAllFlightsIsToldWithItsFrequency) {
  const auto seen =
      world_with({Hides::tone, Where::up, {Quantity::t, Quantity::t}, {2 * M_PI * 0.07, 0}, {0.8, 0}, 0}, 1);
  EXPECT_GT(seen.explained, 0.15);
  const auto result = studied(seen.observations);
  ASSERT_EQ(result.verdict, StudyVerdict::unknown_structure) << study_worlds::told(result);
  EXPECT_EQ(result.unknown.front().along, "t_s");
  EXPECT_NEAR(result.unknown.front().hz.value(), 0.07, 0.006);
  EXPECT_LE(result.unknown.front().p, CauseSearchOptions{}.accept_p);
}

TEST(Structures, AThirdHarmonicOfTheHeadingIsTold) {
  const auto seen = world_with({Hides::heading, Where::up, {Quantity::yaw, Quantity::t}, {3, 0}, {0.4, 0}, 0}, 1);
  EXPECT_GT(seen.explained, 0.15);
  const auto result = studied(seen.observations);
  ASSERT_EQ(result.verdict, StudyVerdict::unknown_structure) << study_worlds::told(result);
  EXPECT_EQ(result.unknown.front().along, "yaw_rad");
  EXPECT_EQ(result.unknown.front().shape, "turn 3");
}

TEST(Structures, AProductOfTwoPlacesIsToldWithBoth) {
  const auto seen = world_with(
      {Hides::product, Where::level, {Quantity::x, Quantity::y}, {2 * M_PI / 3, 2 * M_PI / 3}, {0.3, 0.9}, 0.5}, 1);
  EXPECT_GT(seen.explained, 0.15);
  const auto result = studied(seen.observations);
  ASSERT_EQ(result.verdict, StudyVerdict::unknown_structure) << study_worlds::told(result);
  EXPECT_EQ(result.unknown.front().along, "x_m, y_m");
}

TEST(Structures, HarmonicsAreAddedUntilTheGainEnds) {
  auto seen = quiet();
  for (std::size_t i = 0; i < seen.windows.size(); ++i)
    seen.y[kMeanZ][i] += 0.3 * std::cos(3 * seen.windows[i].yaw()) + 0.25 * std::cos(5 * seen.windows[i].yaw());
  const auto result = studied(seen);
  ASSERT_EQ(result.verdict, StudyVerdict::unknown_structure) << study_worlds::told(result);
  EXPECT_EQ(result.unknown.front().shape, "turn 3 and 1 more");
}

TEST(Structures, ADependenceWithoutAMeanIsNeverNothingFound) {
  // Gusts change the vertical mean four times as much in the upper half of the flown heights, to both sides alike.
  auto seen = quiet();
  std::mt19937_64 rng(5);
  std::normal_distribution draw(0.0, 0.3);
  std::vector<double> heights;
  for (const auto& w : seen.windows) heights.push_back(w.around.height);
  std::nth_element(heights.begin(), heights.begin() + static_cast<long>(heights.size() / 2), heights.end());
  const double middle = heights[heights.size() / 2];
  for (std::size_t i = 0; i < seen.windows.size(); ++i)
    if (seen.windows[i].around.height > middle) seen.y[kMeanZ][i] += draw(rng);
  const auto result = studied(seen);
  ASSERT_FALSE(result.remaining.empty());
  EXPECT_TRUE(result.remaining.front().found);
  ASSERT_EQ(result.verdict, StudyVerdict::unknown_structure) << study_worlds::told(result);
  EXPECT_EQ(result.unknown.front().shape, "any");
  EXPECT_LE(result.unknown.front().p, CauseSearchOptions{}.accept_p);
}

TEST(Structures, ADependenceThatHalfOfTheFlightsDoNotShowIsNotFound) {
  auto seen = quiet();
  for (std::size_t f = 0; f < seen.flights; f += 2)
    for (std::size_t i = seen.first[f]; i < seen.first[f + 1]; ++i)
      seen.y[kMeanZ][i] += 0.4 * std::cos(3 * seen.windows[i].around.height);
  const auto remaining = remaining_dependence(Evidence(seen), {}, 1);
  EXPECT_TRUE(std::any_of(remaining.begin(), remaining.end(), [](auto& d) { return d.p_holm <= 0.05; }))
      << "all flights together show it";
  for (const auto& d : remaining) EXPECT_FALSE(d.found) << d.group << " on " << d.regressor << " " << d.p_holm;
}

TEST(Structures, NothingFoundListsNoDependence) {
  for (std::uint64_t seed = 4711; seed < 4714; ++seed) {
    const auto result = studied(quiet(seed));
    if (result.verdict != StudyVerdict::nothing_found) continue;
    for (const auto& d : result.remaining) EXPECT_FALSE(d.found) << d.group << " on " << d.regressor;
  }
}

TEST(Structures, TheNullsMaximaAreThoseOfEveryCandidateInEveryDraw) {
  const auto seen = quiet();
  const Evidence evidence(seen);
  const auto draws = sign_draws(seen.units.size(), 40, 3);
  for (const auto each : {each_named, each_structure_candidate}) {
    std::vector<double> expected(draws.size(), 0);
    NullMaxima maxima(draws);
    std::size_t count = 0;
    each(evidence, {}, [&](SearchCandidate&& c) {
      for (std::size_t d = 0; d < draws.size(); ++d) {
        const SmallVector fit = c.normal.fit(draws[d]);
        if (c.effect(fit)) expected[d] = std::max(expected[d], c.normal.gain(draws[d]) - c.prior_nats(fit));
      }
      maxima.add(c);
      ++count;
      // Between the floors of means (0.03) and of ln variances (0.2) of a structure; the outline has no columns to ask.
      const SmallVector between = c.fit * (0.1 / std::sqrt(c.fit.dot(c.size * c.fit)));
      EXPECT_EQ(outline(c).effect(between), c.effect(between)) << c.name;
      if (!c.form) {
        EXPECT_EQ(c.effect(between), c.columns.front().parts.front().channel != kVarX);
      }
      if (count % 20 != 1) return;
      const auto again = filled(outline(c), evidence, {});
      EXPECT_EQ(again.gain, c.gain) << c.name;
      ASSERT_EQ(again.columns.size(), c.columns.size());
      EXPECT_EQ(again.columns.front().parts.front().x, c.columns.front().parts.front().x);
    });
    ASSERT_GT(count, 50u);
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(maxima.sorted(), expected);
  }
}

TEST(StudyWorlds, UnknownsAreAFamilyAndNotAFewShapes) {
  std::set<std::string> drawn;
  std::set<int> kinds, wheres;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const auto s = study_worlds::draw_world({seed, {"unknown"}, 1, 12, ""}).effects.structure;
    drawn.insert(study_worlds::text_of(s));
    kinds.insert(static_cast<int>(s.kind));
    wheres.insert(static_cast<int>(s.where));
  }
  EXPECT_GT(drawn.size(), 45u);
  EXPECT_EQ(kinds.size(), 5u);
  EXPECT_EQ(wheres.size(), 3u);
}

}  // namespace
}  // namespace structures

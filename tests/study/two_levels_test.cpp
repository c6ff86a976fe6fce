// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <random>

#include "core/study/findings/where_it_acts.hpp"
#include "core/study/findings/words.hpp"
#include "core/study/inference/levels/two_levels.hpp"
#include "core/study/inference/rules.hpp"
#include "core/study/windows/signals/distributions.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/study_worlds/shares.hpp"

namespace backwash::study {
namespace {

std::vector<double> drawn(std::mt19937& rng, const std::function<double(std::mt19937&)>& value, int flights = 12) {
  std::vector<double> all;
  for (int f = 0; f < flights; ++f) all.push_back(value(rng));
  return all;
}

/// What no division should be found in, however flights scatter.
TEST(TwoLevels, OneLevelIsDividedNoMoreOftenThanTheLevelSays) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> even(-1, 1);
  const std::vector<std::pair<const char*, std::function<double(std::mt19937&)>>> scatters = {
      {"normal", [&](auto& rng) { return normal(rng); }}, {"even", [&](auto& rng) { return even(rng); }}};
  for (const auto& [name, value] : scatters) {
    std::mt19937 rng(7);
    int divided = 0;
    constexpr int kTrials = 4000;
    for (int k = 0; k < kTrials; ++k) divided += two_levels(drawn(rng, value), 0)->p <= 0.05 ? 1 : 0;
    EXPECT_LE(divided, 0.06 * kTrials) << name;
  }
}

TEST(TwoLevels, FindsTheFlightsWhetherTheyFollowEachOtherOrNot) {
  std::mt19937 rng(3);
  std::normal_distribution<double> scatter(0, 0.01);
  const std::vector<std::vector<bool>> sets = {
      {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1}, {0, 0, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0}, {1, 0, 1, 0, 0, 1, 1, 0, 1, 0, 1, 0}};
  for (const auto& high : sets) {
    std::vector<double> values;
    for (const bool h : high) values.push_back((h ? 0.2 : -0.1) + scatter(rng));
    const auto found = two_levels(values, 0);
    EXPECT_EQ(found->high, high);
    EXPECT_LT(found->p, 1e-4);
    EXPECT_NEAR(found->spread, 0.01, 0.006);
  }
}

TEST(TwoLevels, ALevelBelowTheErrorOfTheFlightsIsNone) {
  const std::vector<double> values = {0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1};
  EXPECT_LT(two_levels(values, 1e-3)->p, 1e-9);
  EXPECT_GT(two_levels(values, 1)->p, 0.5);
  EXPECT_FALSE(two_levels({0, 0, 0, 1, 1}, 0)) << "two levels and a scatter need six";
}

AmplitudeCourse course(std::mt19937& rng, std::size_t begin, std::size_t end, double offset) {
  std::normal_distribution<double> noise(0, 0.1);
  AmplitudeCourse c;
  for (std::size_t i = 0; i < 45; ++i) {
    c.value.push_back(offset + (i >= begin && i < end ? 1 : 0) + noise(rng));
    c.weight.push_back(i % 9 == 4 ? 0 : 100);
  }
  return c;
}

TEST(TwoLevels, AFlightTellsWhenItStepsAndThatItDoesNot) {
  std::mt19937 rng(5);
  for (const auto& [begin, end] : {std::pair<std::size_t, std::size_t>{17, 45}, {0, 30}, {0, 45}, {0, 0}})
    for (int k = 0; k < 50; ++k) {
      const auto at = acting(course(rng, begin, end, 0.05), 0, 1, 0.01, 8, 4);
      EXPECT_NEAR(static_cast<double>(at.begin), static_cast<double>(begin), 1.1);
      EXPECT_NEAR(static_cast<double>(at.end), static_cast<double>(end), 1.1);
    }
  const auto step = largest_step(course(rng, 17, 45, 0), 4);
  ASSERT_TRUE(step);
  EXPECT_NEAR(static_cast<double>(step->at), 17, 1.1);
  EXPECT_NEAR(step->size, 1, 0.1);
  EXPECT_FALSE(largest_step(course(rng, 17, 45, 0), 23)) << "45 windows have no 23 on either side";
}

TEST(TwoLevels, NeighboursThatAreAlikeInflateTheErrorOfAMean) {
  std::mt19937 rng(9);
  std::normal_distribution<double> noise;
  AmplitudeCourse white, red;
  double x = 0;
  for (int i = 0; i < 4000; ++i) {
    white.value.push_back(noise(rng));
    white.weight.push_back(1);
    x = 0.5 * x + noise(rng);
    red.value.push_back(x);
    red.weight.push_back(1);
  }
  EXPECT_NEAR(inflation(white, 4), 1, 0.15);
  EXPECT_NEAR(inflation(red, 4), 1 + 2 * (0.5 + 0.25 + 0.125 + 0.0625), 0.3);
}

/// The density of Student's t with one degree is 1/π/(1 + t²).
TEST(TwoLevels, StudentsTailIsThatOfTheDensity) {
  for (const double t : {0.0, 0.7, 3.0, 40.0})
    EXPECT_NEAR(student_tail(t, 1), 0.5 - std::atan(t) / std::numbers::pi, 1e-12) << t;
}

/// p of a division by its definition.
double p_of(const std::vector<double>& values, const std::vector<bool>& high, double tried, double lost) {
  double count[2] = {}, mean[2] = {}, square = 0;
  for (std::size_t f = 0; f < values.size(); ++f) {
    count[high[f]] += 1;
    mean[high[f]] += values[f];
  }
  if (count[0] == 0 || count[1] == 0) return 1;
  for (const int k : {0, 1}) mean[k] /= count[k];
  for (std::size_t f = 0; f < values.size(); ++f) square += std::pow(values[f] - mean[high[f]], 2);
  const double n = static_cast<double>(values.size());
  const double t = std::abs(mean[1] - mean[0]) / std::sqrt(square / (n - 2) * (1 / count[0] + 1 / count[1]));
  return std::min(1.0, 3 * tried * 2 * student_tail(t, n - lost));
}

/// Least p of all divisions, each tried.
double least_p(const std::vector<double>& values) {
  const std::size_t n = values.size();
  const double flights = static_cast<double>(n);
  double least = 1;
  const auto offer = [&](auto high, double tried, double lost) {
    std::vector<bool> sides(n);
    for (std::size_t f = 0; f < n; ++f) sides[f] = high(f);
    least = std::min(least, p_of(values, sides, tried, lost));
  };
  for (std::size_t a = 2; a + 2 <= n; ++a) offer([=](std::size_t f) { return f >= a; }, flights - 1, 2);
  for (std::size_t a = 1; a + 1 < n; ++a)
    for (std::size_t b = a + 2; b < n; ++b)
      offer([=](std::size_t f) { return f >= a && f < b; }, (flights - 1) * (flights - 2) / 2, 2);
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t k = 2; k + 2 <= n; ++k)
    offer([&](std::size_t f) { return values[f] >= sorted[k]; }, std::exp2(flights - 1), 2 + kRules.level_scatter);
  return least;
}

TEST(TwoLevels, TheDivisionIsTheClearestOfAllThatAreTried) {
  std::mt19937 rng(11);
  std::normal_distribution<double> normal;
  int below = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const int flights = 6 + trial % 20;
    const double step = 2 * (trial % 5), offset = trial % 3 == 0 ? 1000 : 0;
    std::vector<double> values;
    for (int f = 0; f < flights; ++f)
      values.push_back(offset + normal(rng) + (f >= flights / 3 && f < flights / 3 + 1 + trial % 7 ? step : 0));
    if (trial % 4 == 1)
      for (double& x : values) x = std::round(x);  // many are the same
    const double expected = least_p(values), found = two_levels(values, 0)->p;
    below += expected < 1 ? 1 : 0;
    EXPECT_NEAR(found, expected, 1e-6 * expected) << "trial " << trial;
  }
  EXPECT_GT(below, 100);
}

// Causes that act in some of twelve flights (rates: study_shares, docs/measurements/study.md).

const std::filesystem::path& folder() {
  static const struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("some-flights-" + std::to_string(::getpid()));
    ~Folder() { std::filesystem::remove_all(path); }
  } made;
  return made.path;
}

TEST(SomeFlights, ARotorThatReadsHalfInSomeFlightsIsToldWithItsFlights) {
  for (const auto& [layout, count] : {std::pair("run", 4), {"any", 6}, {"any", 8}}) {
    const auto told = study_worlds::score(study_worlds::SharedFault{"rpm", count, layout, 1}, 4711, folder());
    EXPECT_TRUE(told.exact() && told.rotor && !told.wrong) << layout << " " << count << ": " << told.told;
  }
}

TEST(SomeFlights, AFaultThatBeginsWithinAFlightIsToldWithItsMoment) {
  const auto told = study_worlds::score(study_worlds::SharedFault{"rpm", 4, "since", 1}, 4712, folder());
  EXPECT_TRUE(told.exact()) << told.told;
  EXPECT_NEAR(told.told_since_s, told.since_s, 3) << told.told;
}

TEST(SomeFlights, ADamagedPropellersLineIsNoVibrationOfTheOtherFlights) {
  const auto told = study_worlds::score(study_worlds::SharedFault{"propeller_damage", 4, "run", 1}, 880002, folder());
  EXPECT_TRUE(told.exact() && told.rotor && !told.wrong) << told.told;
}

TEST(SomeFlights, ACauseOfAllFlightsIsNotDivided) {
  for (const char* cause : {"rotor_sensor_fault", "propeller_damage", "payload", "trim", "draft"}) {
    const auto world = study_worlds::draw_world({4711, {cause}, 1.5, 12, ""});
    auto options = study_worlds::with_reference(world, folder());
    options.minimum_detectable = options.dependence = false;
    for (const auto& named : study(study_worlds::observe(world, folder()), options).causes)
      EXPECT_TRUE(named.flights.empty()) << cause << ": " << named.found.form->cause() << ", " << where(named);
  }
}

TEST(SomeFlights, WhatActsInSomeFlightsDoesNotJoinTheModel) {
  study_worlds::Request request{4711, {"propeller_damage"}, 4, 12, "", {6, 7, 8, 9, 10, 11}};
  const auto world = study_worlds::draw_world(request);
  auto options = study_worlds::with_reference(world, folder());
  options.minimum_detectable = options.dependence = false;
  const auto result = study(study_worlds::observe(world, folder()), options);
  ASSERT_EQ(result.causes.size(), 1u) << study_worlds::told(result);
  const auto& cause = result.causes.front();
  EXPECT_EQ(cause.found.form->cause(), "propeller_damage");
  EXPECT_TRUE(where(cause).ends_with(", flights 7-12")) << where(cause);
  EXPECT_FALSE(cause.applied.refused.empty());
  EXPECT_GT(cause.gain.held_out_nats, 0);
  EXPECT_LT(cause.gain.rmse_after, cause.gain.rmse_before);
  const double truth = 1 / (1 - world.effects.of("propeller_damage")) - 1;
  EXPECT_NEAR(cause.found.parameters[0].value, truth, 0.2 * std::abs(truth));
}

/// −1.23 was told of a rotor that reads 0.54 of its speed: ln 0.54², as if it were 0.54² − 1.
TEST(ItsWords, OfLogarithmsAreShares) {
  const auto form = [](const std::string& cause) {
    for (const Form* f : catalogue())
      if (f->cause() == cause && f->integer_scale) return f;
    throw std::logic_error(cause);
  };
  const Windows windows(3);
  Accepted rotor{}, weight{};
  rotor.form = form("rotor_sensor_fault");
  weight.form = form("payload");
  rotor.columns = form("rotor_sensor_fault")->columns(windows, Scale());
  weight.columns = form("payload")->columns(windows, Scale());
  rotor.parameters = {{"e", 2 * std::log(0.54), 2 * std::log(0.5), 0}, {"rotor", 3, 3, 3}};
  rotor = in_words(rotor);
  EXPECT_NEAR(rotor.parameters[0].value, 0.54 * 0.54 - 1, 1e-12);
  EXPECT_NEAR(rotor.parameters[0].low, -0.75, 1e-12);
  EXPECT_EQ(rotor.parameters[1].value, 3);
  weight.parameters = {{"m_first", std::log(1.2 / 0.8) / 2, 0, 0}, {"m_second", 0, 0, 0}, {"pairing", 2, 2, 2}};
  weight = in_words(weight);
  EXPECT_NEAR(weight.parameters[0].value, 0.2, 1e-12) << "(1 + m) and (1 - m) of the mean";
}

TEST(SomeFlights, AreWrittenAsRunsWithTheMomentsOfTheirSteps) {
  NamedCause cause{};
  cause.found.parameters = {{"d", 0.1, 0, 0.2}, {"rotor", 3, 3, 3}};
  EXPECT_EQ(where(cause), "");
  cause.flights = {{4, 34.2, {}}, {5}, {6}, {7}};
  EXPECT_EQ(where(cause), "rotor 3, flights 5-8, since 34 s in flight 5");
  cause.flights = {{0}, {1}, {3}, {7, {}, 12.0}};
  EXPECT_EQ(where(cause), "rotor 3, flights 1, 2, 4, 8, until 12 s in flight 8");
}

}  // namespace
}  // namespace backwash::study

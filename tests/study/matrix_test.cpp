// SPDX-License-Identifier: BSD-3-Clause
// What the confusion matrix counts, and the study's steps that its figures led to.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <future>
#include <nlohmann/json.hpp>
#include <random>

#include "core/study/inference/evidence.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/study_worlds/oracle.hpp"
#include "tests/study_worlds/summary.hpp"

namespace {

using namespace study_worlds;

WorldOutcome told_of(const std::string& hidden, std::vector<std::vector<std::string>> sets,
                     std::vector<std::string> unknown = {}) {
  WorldOutcome o;
  o.cell = hidden;
  o.sets = std::move(sets);
  o.unknown = std::move(unknown);
  if (hidden != "none") o.truth = {hidden};
  return o;
}

TEST(StudyMatrix, CountsAFalseNameBesideTheTrueOneAsWrong) {
  EXPECT_TRUE(told_of("trim", {{"trim"}, {"ceiling"}}).wrong_name());
  EXPECT_FALSE(told_of("trim", {{"trim"}, {"ceiling"}}).right());
  EXPECT_TRUE(told_of("none", {{"trim"}}).wrong_name());
  EXPECT_TRUE(told_of("unknown", {{"draft"}}, {"z_m"}).wrong_name());
}

TEST(StudyMatrix, CountsASetWithTheTruthAsNeitherRightAloneNorWrong) {
  const auto o = told_of("trim", {{"draft", "trim"}});
  EXPECT_TRUE(o.in_sets());
  EXPECT_FALSE(o.right());
  EXPECT_FALSE(o.wrong_name());
  EXPECT_TRUE(told_of("unknown", {}, {"z_m"}).right());
  EXPECT_FALSE(told_of("trim", {{"trim"}}, {"z_m"}).right());
}

/// Both move the thrust, so with an offset of the mean beside a constant share the slope would be its by-product.
TEST(StudyMatrix, TwoCausesOfOneThrustAreBothTold) {
  const auto folder = std::filesystem::temp_directory_path() / ("study-pairs-" + std::to_string(::getpid()));
  for (const char* other : {"payload", "battery_sag"}) {
    const auto told = score({"", {other, "thrust_slope"}}, 4713, 1, 12, folder);
    EXPECT_TRUE(told.in_sets()) << to_json(told);
    EXPECT_FALSE(told.wrong_name()) << to_json(told);
  }
  std::filesystem::remove_all(folder);
}

TEST(StudyMatrix, ReferenceFlightsAreOfTheWorldsOwnCraft) {
  // Worlds of one seed have other rooms in other cells, and after another room the craft is drawn anew.
  const auto path = std::filesystem::temp_directory_path() / ("study-matrix-craft-" + std::to_string(::getpid()));
  const auto sound = [&](const char* confound) {
    return study_worlds::sound_rotors(draw_world({4711, {}, 1, 12, confound}), path);
  };
  // A thread remembers the last craft that it flew; a new one remembers none.
  const auto own = std::async(std::launch::async, [&] { return sound(""); }).get();
  sound("bob");
  EXPECT_TRUE((sound("").motor == own.motor).all());
  std::filesystem::remove_all(path);
}

TEST(StudyMatrix, WilsonsIntervalSolvesItsDefiningEquation) {
  // The ends are where |p̂ − p| = z √(p (1 − p)/n).
  for (const auto& [hits, n] : {std::pair{3, 16}, {0, 16}, {16, 16}, {190, 200}}) {
    const Rate r{hits, n};
    const double share = static_cast<double>(hits) / n;
    for (const double p : {r.low(), r.high()})
      EXPECT_NEAR(std::abs(share - p), 1.959964 * std::sqrt(p * (1 - p) / n), 1e-9) << hits << " of " << n;
  }
}

TEST(StudyMatrix, GatesAreMissedByTheCellsThatMissThem) {
  std::vector<WorldOutcome> outcomes;
  for (int i = 0; i < 100; ++i) {
    outcomes.push_back(told_of("trim", {{i < 79 ? "trim" : "draft"}}));
    outcomes.push_back(told_of("draft", {{"draft"}}));
    outcomes.push_back(told_of("none", {}));
  }
  for (const Requirement& gate : gates(summarise(outcomes))) {
    if (gate.name.starts_with("power") || gate.name.starts_with("wrong")) {
      EXPECT_FALSE(gate.held) << gate.name;
      EXPECT_NE(gate.figure.find("trim"), std::string::npos) << gate.figure;
      EXPECT_EQ(gate.figure.find("draft"), std::string::npos) << gate.figure;
    }
    if (gate.name.starts_with("false alarms")) {
      EXPECT_TRUE(gate.held) << gate.figure;
    }
    if (gate.name.starts_with("unknown")) {
      EXPECT_EQ(gate.figure, "not run");
    }
  }
}

TEST(StudyMatrix, ReadsTheOutcomesThatItWrote) {
  auto o = told_of("trim", {{"trim", "draft"}}, {"z_m"});
  o.seed = 12345678901234;
  o.error = 0.25;
  o.compared = {{"body_x_mps2", 0.1, 0.05, 0.15, 0.12, 0.11}};
  const WorldOutcome read = from_json(to_json(o));
  EXPECT_EQ(to_json(read), to_json(o));
  EXPECT_FALSE(read.gain_share.has_value());
  EXPECT_DOUBLE_EQ(parameter_error(read.compared).value(), 0.02 / 0.12);
}

TEST(Evidence, DecorrelatedAxesKeepEachWindowsSumOfSquares) {
  std::mt19937 rng(7);
  std::normal_distribution draw;
  backwash::study::DesignColumn column{
      {{backwash::study::kVarZ, {}}, {backwash::study::kVarX, {}}, {backwash::study::kTail, {}}}};
  for (auto& part : column.parts)
    for (int i = 0; i < 9; ++i) part.x.push_back(draw(rng));
  const auto turned = backwash::study::decorrelated(column);
  for (std::size_t i = 0; i < 9; ++i) {
    const auto square = [i](const backwash::study::DesignColumn& c) {
      double sum = 0;
      for (const auto& part : c.parts) sum += part.x[i] * part.x[i];
      return sum;
    };
    EXPECT_NEAR(square(turned), square(column), 1e-12);
  }
}

/// Share of the variance of a window's height within its dwell that the vertical residual explains.
double height_answers_gusts(const backwash::study::Observations& seen) {
  double hy = 0, hh = 0, yy = 0;
  std::map<std::pair<std::size_t, int>, std::array<double, 3>> dwells;  // count, height, residual
  const auto each = [&](auto use) {
    for (std::size_t i = 0; i < seen.windows.size(); ++i)
      if (const auto& w = seen.windows[i]; w.segment && seen.weight[backwash::study::kMeanZ][i] > 0)
        use(dwells[{w.flight, *w.segment}], w.p_W.z(), seen.y[backwash::study::kMeanZ][i]);
  };
  each([](auto& d, double h, double y) {
    d[0] += 1;
    d[1] += h;
    d[2] += y;
  });
  each([&](auto& d, double h, double y) {
    h -= d[1] / d[0];
    y -= d[2] / d[0];
    hy += h * y;
    hh += h * h;
    yy += y * y;
  });
  return hh > 0 ? hy * hy / (hh * yy) : 0;
}

TEST(Observation, PlacesDoNotAnswerTheGustsThatTheResidualHolds) {
  const auto folder = std::filesystem::temp_directory_path() / ("study-places." + std::to_string(::getpid()));
  const HiddenWorld world = draw_world({4711, {}, 1, 10, ""});
  auto flights = fly_all(world);
  EXPECT_LT(height_answers_gusts(observe(world, flights, folder)), 0.02);
  for (auto& flight : flights)  // without set-points the measured place is all there is
    for (auto& name : flight.names)
      if (name.starts_with("cmd_")) name = "unused_" + name;
  EXPECT_GT(height_answers_gusts(observe(world, flights, folder)), 0.1);
  std::filesystem::remove_all(folder);
}

TEST(Study, TellsTrimAndDraftAsOneSetWhereNoFlightTurned) {
  const auto folder = std::filesystem::temp_directory_path() / ("study-no-turn." + std::to_string(::getpid()));
  const auto cell = std::find_if(cells().begin(), cells().end(), [](auto& c) { return c.name == "trim, no yaw turn"; });
  ASSERT_NE(cell, cells().end());
  const WorldOutcome o = score(*cell, 4711, 1.5, 12, folder);
  std::filesystem::remove_all(folder);
  EXPECT_TRUE(o.in_sets()) << told(o.sets, o.unknown);
  ASSERT_EQ(o.sets.size(), 1u) << told(o.sets, o.unknown);
  EXPECT_EQ(o.sets.front().size(), 2u) << told(o.sets, o.unknown);
}

}  // namespace

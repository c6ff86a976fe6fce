// SPDX-License-Identifier: BSD-3-Clause
#include "research/compare/compare_statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace backwash::sim {
namespace {

RouteOutcome flown(double jerk2, std::size_t contacts = 0, std::size_t outside = 0) {
  RouteOutcome o;
  o.status = plan::PlanStatus::ok;
  o.planned.length_m = 5;
  o.planned.time_s = 6;
  o.planned.jerk2 = jerk2;
  o.flown_m = 5.1;
  o.flown_jerk2 = 20;
  o.energy_J = 400;
  o.samples = 351;
  o.contacts = contacts;
  o.outside = outside;
  o.planning_ms = 10;
  o.clearance_m = contacts > 0 ? -0.01 : 0.05;
  return o;
}
RouteOutcome blocked(plan::PlanStatus status) {
  RouteOutcome o;
  o.status = status;
  return o;
}

const std::vector<CompareMethod> kMethods = {
    {"tight"}, {"margin-0.1", reach::Method::tight, 0.1}, {"margin-0.3", reach::Method::tight, 0.3}};

/// Four pairs: all solve the first two, the third is blocked for the largest margin, the fourth for the first method.
SceneComparison small_scene() {
  using plan::PlanStatus;
  return {"room",
          "quad",
          std::vector<RoutePair>(4),
          {{flown(1), flown(3), flown(100), blocked(PlanStatus::start_blocked)},
           {flown(2, 4), flown(2), flown(100), flown(7)},
           {flown(4), flown(4), blocked(PlanStatus::no_path), blocked(PlanStatus::start_blocked)}}};
}

TEST(RatioOfTotals, IsTheQuotientAndItsIntervalHoldsItEqualPairsHaveNone) {
  const std::vector<double> a = {1, 2, 3, 4}, b = {2, 2, 4, 8}, twice = {2, 4, 6, 8};
  const auto r = ratio_of_totals(a, b, 1);
  EXPECT_DOUBLE_EQ(r.value, 10.0 / 16);
  EXPECT_LT(r.low, r.value);
  EXPECT_GT(r.high, r.value);
  const auto exact = ratio_of_totals(a, twice, 1);
  EXPECT_DOUBLE_EQ(exact.low, 0.5);
  EXPECT_DOUBLE_EQ(exact.high, 0.5);
}

TEST(RatioOfTotals, OfOnePairSaysNothingOfOthers) {
  const std::vector<double> a = {1}, b = {2};
  for (const Interval& r : {ratio_of_totals(a, b, 1), mean_ratio(a, b, 1)}) {
    EXPECT_DOUBLE_EQ(r.value, 0.5);
    EXPECT_FALSE(r.known());
    EXPECT_FALSE(r.high < 1) << "no demand is held by one pair";
  }
}

TEST(MeanRatio, IsGeometricAndUnchangedByTheScaleOfAPair) {
  const std::vector<double> a = {1, 8}, b = {2, 1}, scaled_a = {100, 8}, scaled_b = {200, 1};
  EXPECT_NEAR(mean_ratio(a, b, 1).value, 2, 1e-12);
  EXPECT_NEAR(mean_ratio(scaled_a, scaled_b, 1).value, 2, 1e-12);
}

TEST(Intervals, CoverTheTruthInAboutNineteenOfTwentyExperiments) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, 0.5);
  constexpr int kExperiments = 200;
  int covered = 0;
  for (int n = 0; n < kExperiments; ++n) {
    std::vector<double> a, b;
    for (int i = 0; i < 50; ++i) {
      b.push_back(std::exp(noise(random)));
      a.push_back(0.7 * b.back() * std::exp(noise(random)));
    }
    const auto r = mean_ratio(a, b, static_cast<std::uint64_t>(n));
    covered += r.low <= 0.7 && 0.7 <= r.high;
  }
  // 95 % of 200 are 190 ± 3; the percentile bootstrap of 50 pairs is a little narrow.
  EXPECT_GE(covered, 178);
  EXPECT_LE(covered, 198);
}

TEST(Table, ComparesOnThePairsThatAllSolveAndCountsTheRestApart) {
  const auto scene = small_scene();
  const auto table = tabulate(std::span(&scene, 1), kMethods, 1);
  EXPECT_EQ(table.common_pairs, 2u);
  ASSERT_EQ(table.rows.size(), 3u);
  EXPECT_DOUBLE_EQ(table.rows[0].common[kJerk2], 4);  // 100 is not common
  EXPECT_DOUBLE_EQ(table.rows[1].common[kJerk2], 4);
  EXPECT_DOUBLE_EQ(table.rows[2].common[kJerk2], 8);
  EXPECT_DOUBLE_EQ(table.rows[2].common[kLength], 10);
  EXPECT_EQ(table.rows[0].solved, 3u);
  EXPECT_EQ(table.rows[1].solved, 4u);
  EXPECT_EQ(table.rows[2].status.at("no_path"), 1u);
  EXPECT_EQ(table.rows[2].status.at("start_blocked"), 1u);
  EXPECT_EQ(table.rows[0].eligible, 3u);
  EXPECT_EQ(table.rows[1].solved_of_eligible, 3u);
  EXPECT_EQ(table.rows[2].solved_of_eligible, 2u);
  EXPECT_NEAR(table.rows[1].flown_m, 20.4, 1e-12);
  EXPECT_EQ(table.rows[1].contacts, 1u);
  EXPECT_EQ(table.rows[1].contact_samples, 4u);
  EXPECT_EQ(table.rows[1].smallest_clearance_m, -0.01);
  EXPECT_EQ(table.rows[2].on_common.pairs, 2u);
  EXPECT_DOUBLE_EQ(table.rows[2].on_common.total[kJerk2].value, 0.5);
  EXPECT_EQ(table.rows[1].pairwise.pairs, 3u);
  EXPECT_DOUBLE_EQ(table.rows[1].pairwise.total[kJerk2].value, 1);
}

TEST(Measures, ShapeIsUnchangedByPaceAndScaleAnd720OnALineAtLeastJerk) {
  auto o = flown(720 * 4.0 * 4.0 / std::pow(5.0, 5));  // ∫ (60 L/T³ (1 − 6u + 6u²))² dt = 720 L²/T⁵
  o.planned.length_m = 4;
  o.planned.time_s = 5;
  EXPECT_NEAR(value(o, kShape), 720, 1e-9);
  o.planned.time_s *= 2;
  o.planned.jerk2 /= 32;
  EXPECT_NEAR(value(o, kShape), 720, 1e-9);
  o.planned.length_m *= 3;
  o.planned.jerk2 *= 9;
  EXPECT_NEAR(value(o, kShape), 720, 1e-9);
}

TEST(Table, JoinsScenes) {
  const std::vector<SceneComparison> scenes = {small_scene(), small_scene()};
  const auto table = tabulate(scenes, kMethods, 1);
  EXPECT_EQ(table.common_pairs, 4u);
  EXPECT_EQ(table.rows[0].pairs, 8u);
  EXPECT_DOUBLE_EQ(table.rows[2].common[kJerk2], 16);
}

TEST(Demands, ForgiveMarginsThatTouchAndNoOthers) {
  const auto scene = small_scene();
  const auto table = tabulate(std::span(&scene, 1), kMethods, 1);
  const auto list = demands(table, kMethods);
  // Contacts, outside; margin-0.1 touches; margin-0.3: jerk² 1/4 and 3/4 of it, fewer pairs without a path.
  ASSERT_EQ(list.size(), 5u);
  for (const auto& demand : list) EXPECT_TRUE(demand.met) << demand.text;
}

TEST(Demands, AreMissedByAContactASampleOutsideMoreJerkOrFewerPaths) {
  auto scene = small_scene();
  scene.outcomes[0][0] = flown(9, 1, 2);
  scene.outcomes[0][1] = flown(9);
  scene.outcomes[0][2] = blocked(plan::PlanStatus::infeasible);
  scene.outcomes[2][2] = flown(1);
  const auto list = demands(tabulate(std::span(&scene, 1), kMethods, 1), kMethods);
  ASSERT_EQ(list.size(), 6u);  // now margin-0.1 has no more contacts either
  for (const auto& demand : list) EXPECT_FALSE(demand.met) << demand.text;
}

TEST(Demands, CountNoPairAsMissed) {
  auto scene = small_scene();
  for (auto& outcome : scene.outcomes[2]) outcome = blocked(plan::PlanStatus::no_path);
  const auto list = demands(tabulate(std::span(&scene, 1), kMethods, 1), kMethods);
  EXPECT_FALSE(list[3].met) << list[3].text;
}

}  // namespace
}  // namespace backwash::sim

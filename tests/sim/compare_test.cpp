// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "research/compare/compare.hpp"
#include "research/compare/compare_statistics.hpp"

namespace backwash::sim {
namespace {

Vehicle vehicle_5in() { return config::load_vehicle("builtin:quad-5in").value(); }
map::OccupancyGrid scene(const std::string& name) { return map::builtin_scene(name).value(); }

plan::World world_of(const std::string& name, const Vehicle& vehicle, const Model& model = {}) {
  return *plan::build_world(scene(name), model, vehicle);
}

/// Distance from p to the nearest voxel that is not free, by looking at all of them within 0.4 m, m; 0.3 if farther.
double brute_distance(const map::OccupancyGrid& grid, const Vec3& p) {
  double least = 0.3;
  const Index3 low = grid.index(p - Vec3::Constant(0.4)), high = grid.index(p + Vec3::Constant(0.4));
  for (int k = low.z(); k <= high.z(); ++k)
    for (int j = low.y(); j <= high.y(); ++j)
      for (int i = low.x(); i <= high.x(); ++i) {
        if (grid.free({i, j, k})) continue;
        const Vec3 gap = (p - grid.center({i, j, k})).cwiseAbs() - Vec3::Constant(grid.resolution() / 2);
        least = std::min(least, gap.cwiseMax(0.0).norm());
      }
  return least;
}

std::vector<RoutePair> pairs_in(const plan::World& world, std::size_t count, std::uint64_t seed) {
  return draw_pairs(world.grid, world.distance, world.reach.vehicle, count, seed).value();
}

void expect_same(const RouteOutcome& a, const RouteOutcome& b) {
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.planned.length_m, b.planned.length_m);
  EXPECT_EQ(a.planned.jerk2, b.planned.jerk2);
  EXPECT_EQ(a.flown_m, b.flown_m);
  EXPECT_EQ(a.flown_jerk2, b.flown_jerk2);
  EXPECT_EQ(a.energy_J, b.energy_J);
  EXPECT_EQ(a.clearance_m, b.clearance_m);
  EXPECT_EQ(a.samples, b.samples);
  EXPECT_EQ(a.outside, b.outside);
}

TEST(DrawPairs, GivesPointsThatFitTheBodyAtFlightHeightAndFarApart) {
  const auto grid = scene("apartment");
  const map::DistanceField distance(grid);
  const Vehicle vehicle = vehicle_5in();
  const auto pairs = draw_pairs(grid, distance, vehicle, 40, 7).value();
  ASSERT_EQ(pairs.size(), 40u);
  std::set<std::uint64_t> seeds;
  for (const auto& pair : pairs) {
    EXPECT_GE((pair.goal_W - pair.start_W).norm(), 3.0);
    seeds.insert(pair.seed);
    for (const Vec3& p : {pair.start_W, pair.goal_W}) {
      EXPECT_GT(brute_distance(grid, p), 0.16 + 0.02);
      double under = p.z();
      while (grid.free(grid.index({p.x(), p.y(), under}))) under -= 0.01;
      EXPECT_GE(p.z() - under, 0.45);
      EXPECT_LE(p.z() - under, 2.05);
    }
  }
  EXPECT_EQ(seeds.size(), 40u) << "each pair has air of its own";
}

TEST(DrawPairs, DependsOnTheSeedAlone) {
  const auto grid = scene("apartment");
  const map::DistanceField distance(grid);
  const auto draw = [&](std::size_t count, std::uint64_t seed) {
    return draw_pairs(grid, distance, vehicle_5in(), count, seed).value();
  };
  const auto a = draw(5, 1), b = draw(8, 1), c = draw(5, 2);
  for (std::size_t n = 0; n < a.size(); ++n) {
    EXPECT_EQ(a[n].start_W, b[n].start_W);
    EXPECT_EQ(a[n].goal_W, b[n].goal_W);
    EXPECT_EQ(a[n].seed, b[n].seed);
  }
  EXPECT_NE(a[0].seed, c[0].seed);
}

TEST(DrawPairs, StaysInOneRoomIfNoDoorLetsTheBodyThrough) {
  auto grid = scene("narrow-gap");
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {  // what is left of the gap is 0.3 m wide
    const Vec3 c = grid.center(grid.voxel(n));
    if (c.x() > 2.9 && c.x() < 3.2 && std::abs(c.y()) > 0.15) grid.set(grid.voxel(n), map::Cell::occupied);
  }
  const auto pairs = draw_pairs(grid, map::DistanceField(grid), vehicle_5in(), 30, 1).value();
  for (const auto& pair : pairs) EXPECT_EQ(pair.start_W.x() < 3, pair.goal_W.x() < 3);
}

TEST(DrawPairs, FindsNothingWhereNothingFits) {
  Vehicle huge = vehicle_5in();
  huge.body.radius = 3;
  const auto grid = scene("narrow-gap");
  EXPECT_FALSE(draw_pairs(grid, map::DistanceField(grid), huge, 1, 1));
}

/// A route whose samples are made up: two at rest, then the thrust tilts.
TEST(Measure, IntegratesInducedPowerAndTheJerkOfTheThrust) {
  const Vehicle vehicle = vehicle_5in();
  const auto world = world_of("narrow-gap", vehicle);
  Route route;
  route.plan.status = plan::PlanStatus::ok;
  FlightSample sample{};
  sample.truth.p_W = {1, 0, 1.2};
  sample.acceleration.setZero();
  sample.attitude.setIdentity();
  sample.thrust = 0.5;  // 18 N · (0.3 · 0.25 + 0.7 · 0.5) = 7.65 N
  for (const double tilt : {0.0, 0.0, 0.1}) {
    sample.attitude = Eigen::AngleAxisd(tilt, Vec3::UnitX());
    route.piece.samples.push_back(sample);
    route.piece.judged.push_back({.judged = true, .inside = true, .half_widths = {1, 1, 1, 1, 1}});
    route.piece.clearance_m.push_back(1);
  }
  const auto outcome = measure(route, world, vehicle);
  const double disc = 4 * std::numbers::pi * 0.0635 * 0.0635;
  EXPECT_NEAR(outcome.energy_J, 0.04 * std::pow(7.65, 1.5) / std::sqrt(2 * 1.225 * disc), 1e-9);
  const double change = 2 * std::sin(0.05) * 7.65 / 0.9;  // chord between the two accelerations, m/s²
  EXPECT_NEAR(outcome.flown_jerk2, change * change / 0.02, 1e-9);
  EXPECT_EQ(outcome.flown_m, 0);
}

// The planted crash: the planner believes in a body of 2 cm, what flies has 16 cm. Contacts are counted against all
// voxels, one by one.
TEST(FlyRoute, CountsTheContactsOfAVehicleThatIsLargerThanPlanned) {
  const Vehicle real = vehicle_5in();
  Vehicle believed = real;
  believed.body.radius = 0.02;
  const auto wrong = *plan::rebuilt(world_of("corridors", believed),
                                    {.clearance = plan::Clearance{plan::sets_of(believed, reach::Method::tight), 0.0}});
  std::size_t contacts = 0, flights = 0;
  for (const auto& pair : pairs_in(world_of("corridors", real), 12, 3)) {
    const auto route = fly_route(wrong, real, pair);
    if (route.plan.status != plan::PlanStatus::ok) continue;
    const auto outcome = measure(route, wrong, real);
    std::size_t expected = 0;
    for (const auto& sample : route.piece.samples)
      if (brute_distance(wrong.grid, sample.truth.p_W) < 0.16) ++expected;
    EXPECT_EQ(outcome.contacts, expected);
    EXPECT_EQ(outcome.contacts > 0, outcome.clearance_m < 0);
    contacts += expected > 0;
    flights += 1;
  }
  EXPECT_GT(flights, 5u);
  EXPECT_GT(contacts, 0u) << "a crash must be seen";
}

TEST(Measure, CountsASampleThatWasNotJudgedAsOutside) {
  const Vehicle vehicle = vehicle_5in();
  const auto world = world_of("narrow-gap", vehicle);
  Route route;
  FlightSample sample{};
  sample.acceleration.setZero();
  sample.attitude.setIdentity();
  route.piece.samples = {sample};
  route.piece.judged = {track::Inside{}};
  route.piece.clearance_m = {1};
  EXPECT_EQ(measure(route, world, vehicle).outside, 1u);
}

TEST(FlyRoute, StaysInsideItsSetsAndIsCaughtOutsideSetsOfATwentyFifthOfTheVariance) {
  const Vehicle vehicle = vehicle_5in();
  Model small;
  small.bound.kappa /= 5;
  small.bound.mean_horizontal = small.bound.mean_vertical = 0;
  Vehicle sure = vehicle;
  sure.initial_error = {0.001, 0.002};
  const auto honest = world_of("apartment", vehicle), mutant = world_of("apartment", sure, small);
  std::size_t outside = 0, samples = 0, mutant_outside = 0;
  for (const auto& pair : pairs_in(honest, 6, 5)) {
    const auto a = measure(fly_route(honest, vehicle, pair), honest, vehicle);
    outside += a.outside;
    samples += a.samples;
    EXPECT_EQ(a.contacts, 0u);
    mutant_outside += measure(fly_route(mutant, vehicle, pair), mutant, vehicle).outside;
  }
  EXPECT_GT(samples, 1000u);
  EXPECT_EQ(outside, 0u);
  EXPECT_GT(mutant_outside, 100u);
}

TEST(CompareScene, FliesTheSamePairsInTheSameAirWhateverTheOrderAndTheWork) {
  const auto world = world_of("apartment", vehicle_5in());
  const auto pairs = pairs_in(world, 6, 2);
  const std::vector<CompareMethod> twice = {{"tight"}, {"margin", reach::Method::tight, 0.1}, {"again"}};
  const Parallel backwards = [](std::size_t count, const auto& work) {
    for (std::size_t end = count; end > 0; --end) work(end - 1, end);
  };
  const auto one = compare_scene("apartment", world, pairs, twice);
  const auto two = compare_scene("apartment", world, pairs, twice, backwards);
  ASSERT_EQ(one.outcomes.size(), 3u);
  std::size_t solved = 0, differ = 0;
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    for (std::size_t m = 0; m < 3; ++m) expect_same(one.outcomes[m][n], two.outcomes[m][n]);
    expect_same(one.outcomes[0][n], one.outcomes[2][n]);  // the method between leaves no trace
    solved += one.outcomes[0][n].status == plan::PlanStatus::ok;
    differ += one.outcomes[0][n].planned.jerk2 != one.outcomes[1][n].planned.jerk2;
  }
  EXPECT_GT(solved, 2u);
  EXPECT_GT(differ, 0u);
}

TEST(CompareMethods, AreTheSetsTwoVariantsOfThemAndFourMargins) {
  const auto methods = compare_methods();
  ASSERT_EQ(methods.size(), 7u);
  for (std::size_t m = 0; m < 3; ++m) {
    EXPECT_FALSE(methods[m].margin);
    EXPECT_EQ(methods[m].norm_cost, m == 1);
    EXPECT_EQ(methods[m].sets, m == 2 ? reach::Method::paper : reach::Method::tight);
  }
  for (std::size_t m = 3; m < 7; ++m) EXPECT_NEAR(methods[m].margin.value(), 0.1 * static_cast<double>(m - 2), 1e-12);
}

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

// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/airflow_truth.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "core/config/config.hpp"
#include "core/field/disturbance_field.hpp"
#include "core/map/distance_field.hpp"
#include "core/map/load_map.hpp"
#include "core/sim/vehicle/quadrotor.hpp"

namespace backwash::sim {
namespace {

Vehicle vehicle(const char* name = "builtin:quad-5in") { return config::load_vehicle(name).value(); }
const map::OccupancyGrid& corridor() {
  static const auto grid = map::builtin_scene("parallel-walls-2m").value();
  return grid;
}
// Faces of the walls at y = ±1, floor at 0, open above.
const Vec3 kNearWallAndFloor(0.02, 0.6, 0.5), kNearWall(0.02, 0.6, 1.3), kNearFloor(0.02, 0.02, 0.35);

/// Samples of step() at one place.
struct Record {
  double dt;
  std::array<std::vector<double>, 3> w;
  Record(const Vec3& p, double step, std::size_t count, std::uint64_t seed) : dt(step) {
    AirflowTruth truth(corridor(), vehicle(), seed);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 sample = truth.step(p, step);
      for (std::size_t axis = 0; axis < 3; ++axis) w[axis].push_back(sample[static_cast<int>(axis)]);
    }
  }
  double moment(std::size_t axis, double about, int order) const {
    double sum = 0;
    for (const double x : w[axis]) sum += std::pow(x - about, order);
    return sum / static_cast<double>(w[axis].size());
  }
};

TEST(AirflowTruth, LongTimeMomentsAreWhatItDocumentsWithHeavyButBoundedTails) {
  const AirflowTruth truth(corridor(), vehicle(), 0);
  for (const Vec3& p : {kNearWallAndFloor, kNearWall, kNearFloor}) {
    const Record record(p, 0.02, 150'000, 11);  // 50 minutes
    const Vec3 variance = truth.variance(p), mean = truth.mean(p);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int i = static_cast<int>(axis);
      const double sigma = std::sqrt(variance[i]), measured = record.moment(axis, mean[i], 2);
      EXPECT_NEAR(measured / variance[i], 1, 0.15);
      // Mean of N/(2·integral time) independent draws: 3000 s/0.3 s = 10⁴, so 0.01 σ.
      EXPECT_NEAR(record.moment(axis, 0, 1), mean[i], 0.05 * sigma);
      EXPECT_GT(record.moment(axis, mean[i], 4) / (measured * measured), 3.3);
      const auto [low, high] = std::minmax_element(record.w[axis].begin(), record.w[axis].end());
      EXPECT_LE(std::max(*high - mean[i], mean[i] - *low), AirflowTruth::kLargestGust * sigma);
      EXPECT_GT(std::max(*high - mean[i], mean[i] - *low), 2.8 * sigma);
    }
  }
}

TEST(AirflowTruth, CorrelationTimeIsThatOfGusts) {
  const Record record(kNearWallAndFloor, 0.01, 100'000, 5);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& w = record.w[axis];
    const double mean = record.moment(axis, 0, 1), variance = record.moment(axis, mean, 2);
    std::size_t lag = 0;
    for (double correlation = 1; correlation > std::exp(-1); ++lag) {
      double sum = 0;
      for (std::size_t i = lag + 1; i < w.size(); ++i) sum += (w[i] - mean) * (w[i - lag - 1] - mean);
      correlation = sum / static_cast<double>(w.size()) / variance;
    }
    EXPECT_GT(static_cast<double>(lag) * record.dt, 0.10);
    EXPECT_LT(static_cast<double>(lag) * record.dt, 0.25);
  }
}

TEST(AirflowTruth, StatisticsDoNotDependOnTheStep) {
  const Record fine(kNearFloor, 0.002, 600'000, 3), coarse(kNearFloor, 0.05, 60'000, 4);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double a = fine.moment(axis, fine.moment(axis, 0, 1), 2);
    const double b = coarse.moment(axis, coarse.moment(axis, 0, 1), 2);
    EXPECT_NEAR(a / b, 1, 0.2);  // 20 and 50 minutes: 5 % and 3 % of chance each
  }
}

TEST(AirflowTruth, RepeatsBySeed) {
  AirflowTruth a(corridor(), vehicle(), 3), b(corridor(), vehicle(), 3), c(corridor(), vehicle(), 4);
  bool differs = false;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 wa = a.step(kNearWall, 1e-3);
    EXPECT_EQ(wa, b.step(kNearWall, 1e-3));
    differs = differs || wa != c.step(kNearWall, 1e-3);
  }
  EXPECT_TRUE(differs);
}

TEST(AirflowTruth, FallsWithTheDistanceFromFloorAndWall) {
  const auto grid = map::builtin_scene("parallel-walls-4m").value();
  const AirflowTruth truth(grid, vehicle(), 0);
  Vec3 before = truth.variance({0.02, 0.02, 0.2});
  for (double z = 0.3; z < 3.3; z += 0.1) {
    const Vec3 now = truth.variance({0.02, 0.02, z});
    for (int i = 0; i < 3; ++i) EXPECT_LT(now[i], before[i]) << z;
    before = now;
  }
  before = truth.variance({0.02, -1.8, 1.4});
  for (double d = 0.3; d < 1.8; d += 0.1) {
    const Vec3 now = truth.variance({0.02, -2 + d, 1.4});
    for (int i = 0; i < 3; ++i) EXPECT_LT(now[i], before[i]) << d;
    before = now;
  }
}

TEST(AirflowTruth, PushesTowardsAWallHighUpAwayFromItLowDownAndUpOverTheFloor) {
  const AirflowTruth truth(corridor(), vehicle(), 0);
  EXPECT_GT(truth.mean({0.02, 0.6, 1.5}).y(), 0.003);
  EXPECT_LT(truth.mean({0.02, 0.6, 0.25}).y(), -0.003);
  EXPECT_GT(truth.mean({0.02, 0.02, 0.25}).z(), 0.01);
  EXPECT_NEAR(truth.mean({0.02, 0.0, 1.5}).y(), 0, 1e-3);  // between the walls they cancel
}

TEST(AirflowTruth, IsTheSameBesideAWallAtAnyYaw) {
  const auto at_yaw = [](double yaw) {
    map::OccupancyGrid grid({-4, -4, -0.1}, 0.05, {160, 160, 60}, map::Cell::free);
    const Vec3 m(std::cos(yaw), std::sin(yaw), 0);
    for (std::size_t i = 0; i < grid.cell_count(); ++i) {
      const Index3 v = grid.voxel(i);
      if (m.dot(grid.center(v)) > 0.5) grid.set(v, map::Cell::occupied);
    }
    const AirflowTruth truth(grid, vehicle(), 0);
    return truth.variance({0.01, 0.01, 1.5});
  };
  // x and y change places and mix as the wall turns; their sum and z must not change. The staircase of voxels sets the
  // wall back by up to a/2 (7 % here), and 24 rays sample it.
  const Vec3 straight = at_yaw(0);
  for (const double yaw : {0.1, 0.3, 0.5, 0.785}) {
    const Vec3 turned = at_yaw(yaw);
    EXPECT_NEAR(turned.head<2>().sum() / straight.head<2>().sum(), 1, 0.15) << yaw;
    EXPECT_NEAR(turned.z() / straight.z(), 1, 0.15) << yaw;
  }
}

TEST(AirflowTruth, TheLargerVehicleIsShakenHarder) {
  const AirflowTruth small(corridor(), vehicle(), 0), large(corridor(), vehicle("builtin:quad-7in"), 0);
  const Vec3 ratio = large.variance(kNearWall).cwiseQuotient(small.variance(kNearWall));
  EXPECT_NEAR(ratio.minCoeff(), 1.6, 0.05);
  EXPECT_NEAR(ratio.maxCoeff(), 1.6, 0.05);
}

TEST(AirflowTruth, AFlightThroughItRepeatsBitForBit) {
  const auto fly = [](std::uint64_t seed) {
    AirflowTruth truth(corridor(), vehicle(), seed);
    Quadrotor quad(vehicle(), {.p_W = Vec3(-1, 0, 1), .v_W = Vec3::Zero()});
    for (int i = 0; i < 3000; ++i) {
      if (i % 20 == 0) quad.command({.p_W = Vec3(-1 + 5e-4 * i, 0.2, 1), .v_W = Vec3(0.5, 0, 0)});
      quad.step(truth.step(quad.state().p_W, Quadrotor::kStep), quad.state());
    }
    return quad.state().p_W;
  };
  EXPECT_EQ(fly(1), fly(1));
  EXPECT_GT((fly(1) - fly(2)).norm(), 1e-3);
}

// How strong the truth is beside the documented default model: core/sim/README.md quotes what the next two print.
TEST(TruthAndModel, LiesBelowTheModelAtThePlacesOfTheReadme) {
  const auto grid = map::builtin_scene("parallel-walls-4m").value();
  const field::ProximityField field(grid, config::load_model("builtin:quad-5in").value());
  const AirflowTruth truth(grid, vehicle(), 0);
  std::printf("wall m  floor m  along wall  normal  vertical\n");
  for (const double d : {0.3, 0.5, 0.8, 1.2, 2.0})
    for (const double z : {0.3, 0.6, 1.0, 1.5, 2.2}) {
      const Vec3 p(0.02, 2 - d, z);
      const Variance s = field.at(p).sigma();
      const Vec3 ratio = truth.variance(p).cwiseQuotient(Vec3(s.xx, s.yy, s.zz));
      std::printf("%6.1f %8.1f %11.2f %7.2f %9.2f\n", d, z, ratio.x(), ratio.y(), ratio.z());
      EXPECT_GT(ratio.minCoeff(), 0.3);
      EXPECT_LT(ratio.maxCoeff(), 0.95);
    }
}

TEST(TruthAndModel, MostPlacesLieBetween03And09) {
  const Model model = config::load_model("builtin:quad-5in").value();
  for (const char* scene : {"parallel-walls-2m", "apartment", "forest-1"}) {
    const auto grid = map::builtin_scene(scene).value();
    const field::ProximityField field(grid, model);
    const map::DistanceField distance(grid);
    const AirflowTruth truth(grid, vehicle(), 0);
    std::mt19937_64 rng(1);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<double> ratios;
    while (ratios.size() < 1500) {
      const Vec3 p = grid.origin() + grid.resolution() * grid.size().cast<double>().cwiseProduct(
                                                             Vec3(uniform(rng), uniform(rng), uniform(rng)));
      if (distance.interpolated(p) < 0.25) continue;  // the vehicle's centre does not get there
      const Variance s = field.at(p).sigma();
      const Vec3 ratio = truth.variance(p).cwiseQuotient(Vec3(s.xx, s.yy, s.zz));
      ratios.insert(ratios.end(), {ratio.x(), ratio.y(), ratio.z()});
    }
    std::sort(ratios.begin(), ratios.end());
    const auto quantile = [&](double q) { return ratios[static_cast<std::size_t>(q * 1499)]; };
    const auto count = std::count_if(ratios.begin(), ratios.end(), [](double r) { return r >= 0.3 && r <= 0.9; });
    const double share = static_cast<double>(count) / static_cast<double>(ratios.size());
    std::printf("%-18s truth/model 5 %% %.2f, median %.2f, 95 %% %.2f, largest %.2f; %.0f %% in 0.3..0.9\n", scene,
                quantile(0.05), quantile(0.5), quantile(0.95), ratios.back(), 100 * share);
    EXPECT_GT(share, 0.8);
    EXPECT_LT(quantile(0.99), 1.5);
  }
}

/// ∫|g| of lag·ȧ = −kp p − kd v − a + impulse: half width of hover for w̄ = 1 m/s² without feedback delay. The
/// disturbance enters behind the lag: ṗ = v, v̇ = a + w, so g starts at v = 1.
double hover_half_width(double kp, double kd, double lag) {
  const double h = 1e-4;
  Vec3 x(0, 1, 0);
  double sum = 0;
  for (int i = 0; i < 100'000; ++i) {
    const auto f = [&](const Vec3& y) { return Vec3(y.y(), y.z(), (-kp * y.x() - kd * y.y() - y.z()) / lag); };
    const Vec3 k1 = f(x), k2 = f(x + h / 2 * k1);
    x += h * k2;
    sum += h * std::abs(x.x());
  }
  return sum;
}

/// Largest |e_n|/h_n of hovering at p for a minute, h for the model's bound with Σ scaled by `sigma_scale`.
double largest_ratio(const Vec3& p, std::uint64_t seed, double sigma_scale) {
  const Vehicle v = vehicle();
  const Model model = config::load_model("builtin:quad-5in").value();
  const auto grid = map::builtin_scene("parallel-walls-2m").value();
  const field::ProximityField field(grid, model);
  const double unit_h =
      hover_half_width(v.controller.kp.horizontal, v.controller.kd.horizontal, v.controller.attitude_lag);
  const double unit_z = hover_half_width(v.controller.kp.vertical, v.controller.kd.vertical, v.controller.attitude_lag);
  // Bound at the centre of the set only: smaller than what flies, so the test of containment is the stricter.
  const DisturbanceBound b = bound(sigma_scale * field.at(p).sigma(), model.bound);
  AirflowTruth truth(grid, v, seed);
  const State start{.p_W = p, .v_W = Vec3::Zero()};
  Quadrotor quad(v, start);
  double largest = 0;
  for (int i = 0; i < 60'000; ++i) {
    quad.step(truth.step(quad.state().p_W, Quadrotor::kStep), quad.state());
    const Vec3 e = quad.state().p_W - p;
    for (std::size_t d = 0; d < kDirections; ++d) {
      const auto n = static_cast<Direction>(d);
      largest = std::max(largest, std::abs(unit(n).dot(e)) / (b.w[d] * (n == kZ ? unit_z : unit_h)));
    }
  }
  return largest;
}

TEST(TruthAndModel, HoverNearWallsStaysInsideTheSetAndFillsAQuarterOfIt) {
  for (const Vec3& p : {Vec3(0, 0.6, 0.5), Vec3(0.5, -0.55, 0.8), Vec3(-0.5, 0.6, 1.2)})
    for (const std::uint64_t seed : {1, 2}) {
      const double ratio = largest_ratio(p, seed, 1);
      std::printf("hover at %.2f %.2f %.2f: largest |e|/h %.2f\n", p.x(), p.y(), p.z(), ratio);
      EXPECT_GT(ratio, 0.25);
      EXPECT_LT(ratio, 1);
    }
}

TEST(TruthAndModel, AModelWithATwentyFifthOfTheVarianceIsCaughtOutside) {
  for (const Vec3& p : {Vec3(0, 0.6, 0.5), Vec3(0.5, -0.55, 0.8), Vec3(-0.5, 0.6, 1.2)}) {
    const double ratio = largest_ratio(p, 1, 1.0 / 25);
    std::printf("with a 25th of the variance: largest |e|/h %.2f\n", ratio);
    EXPECT_GT(ratio, 1);
  }
}

}  // namespace
}  // namespace backwash::sim

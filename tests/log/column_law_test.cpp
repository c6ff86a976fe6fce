// SPDX-License-Identifier: BSD-3-Clause
// Velocities against positions by Frisch's bounds: what moves is judged, what hardly moves is not.
#include "core/log/columns/column_law.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/log/columns/import_columns.hpp"

namespace backwash::log {
namespace {

constexpr int kRows = 3000;

struct Errors {
  double x, y;
};

/// y = gain·ξ + error, x = ξ + error, ξ of standard deviation 1.
Gain of(double slope, Errors errors, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  std::vector<double> x, y;
  for (int k = 0; k < kRows; ++k) {
    const double truth = std::sqrt(2) * std::sin(0.03 * k);
    x.push_back(truth + errors.x * noise(random));
    y.push_back(slope * truth + errors.y * noise(random));
  }
  return gain_of(x, y);
}

TEST(GainOf, HoldsTheTruthWhicheverOfTheTwoIsInError) {
  int held = 0, cases = 0;
  for (const Errors errors : {Errors{0, 0.5}, {0.5, 0}, {0.3, 0.3}, {1, 1}, {0, 3}, {3, 0}})
    for (const double slope : {1.0, 0.5, -1.0, 100.0})
      for (unsigned seed = 1; seed <= 20; ++seed, ++cases) {
        const Gain gain = of(slope, {errors.x, errors.y * std::abs(slope)}, seed);
        if (gain.sign != 0) {
          EXPECT_EQ(gain.sign, slope > 0 ? 1 : -1);
        }
        held += gain.within(std::abs(slope), std::abs(slope)) ? 1 : 0;
      }
  EXPECT_GE(held, cases * 98 / 100);
  const Gain sharp = of(1, {0.05, 0.05}, 1), wide = of(1, {2, 2}, 1);
  EXPECT_LT(sharp.high / sharp.low, 1.1);
  EXPECT_GT(wide.high / wide.low, 10);
}

TEST(GainOf, SaysNothingOfWhatDoesNotVaryOrOfTooLittle) {
  const std::vector<double> still(100, 0.3), few{1, 2, 3};
  EXPECT_EQ(gain_of(still, still).sign, 0);
  EXPECT_EQ(gain_of(few, few).sign, 0);
  EXPECT_TRUE(gain_of(still, still).within(1, 1));
}

/// 40 s at 100 Hz; each axis has its amplitude, m, and an estimator's noise of 3 mm and 0.03 m/s that says too little
/// of what is fast, by a first-order filter of 0.1 s.
FlightLog estimated(const Vec3& amplitude, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  FlightLog log;
  const double omega[] = {1.1, 0.9, 0.7};
  Vec3 slow = Vec3::Zero();
  for (int k = 0; k < 4000; ++k) {
    const double t = 0.01 * k;
    log.t_s.push_back(t);
    for (int i = 0; i < 3; ++i) {
      const std::string axis(1, "xyz"[i]);
      const double v = amplitude[i] * omega[i] * std::cos(omega[i] * t + i);
      slow[i] += 0.1 * (v - slow[i]);
      log.columns[axis + "_m"].push_back(amplitude[i] * std::sin(omega[i] * t + i) + 0.001 * noise(random));
      log.columns["v" + axis + "_mps"].push_back(slow[i] + 0.03 * noise(random));
    }
  }
  return log;
}

TEST(ColumnLaw, AnAxisThatHardlyMovesIsNeverRefused) {
  for (unsigned seed = 1; seed <= 10; ++seed)
    for (const double small : {0.0, 0.01, 0.05, 0.07}) {
      auto log = estimated({1.5, 1.5, small}, seed);
      for (double& v : log.columns.at("vz_mps")) v *= 0.784;
      const auto left_out = leave_out_doubted(log);
      ASSERT_TRUE(left_out) << left_out.error();
      EXPECT_TRUE(left_out->empty()) << small << ": " << left_out->front();
    }
}

TEST(ColumnLaw, AColumnInAnotherUnitIsLeftOutByItselfAndAWholeLogIsRefusedWithTheUnit) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    auto one = estimated({1.5, 1, 0.8}, seed), all = one, feet = one;
    for (double& v : one.columns.at("vx_mps")) v *= 100;
    const auto left_out = leave_out_doubted(one);
    ASSERT_TRUE(left_out) << left_out.error();
    ASSERT_EQ(left_out->size(), 1u);
    EXPECT_NE(left_out->front().find("vx_mps is in cm/s"), std::string::npos) << left_out->front();
    EXPECT_FALSE(one.has("vx_mps"));
    for (const char* name : {"vx_mps", "vy_mps", "vz_mps"})
      for (double& v : all.columns.at(name)) v *= 100;
    const auto refused = leave_out_doubted(all);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().find("is in cm/s"), std::string::npos) << refused.error();
    for (const char* name : {"x_m", "y_m", "z_m"})
      for (double& p : feet.columns.at(name)) p /= 0.3048;
    const auto in_feet = leave_out_doubted(feet);
    ASSERT_FALSE(in_feet);
    EXPECT_NE(in_feet.error().find("x_m is in ft"), std::string::npos) << in_feet.error();
  }
}

TEST(ColumnLaw, ASignAndExchangedAxesAreToldWithTheWayRound) {
  auto sign = estimated({1.5, 1, 0.8}, 1), exchanged = sign;
  for (double& v : sign.columns.at("vy_mps")) v *= -1;
  const auto turned = leave_out_doubted(sign);
  ASSERT_TRUE(turned) << turned.error();
  ASSERT_EQ(turned->size(), 1u);
  EXPECT_NE(turned->front().find("turn the sign of vy_mps or of y_m"), std::string::npos) << turned->front();
  std::swap(exchanged.columns.at("vx_mps"), exchanged.columns.at("vz_mps"));
  const auto swapped = leave_out_doubted(exchanged);
  ASSERT_TRUE(swapped) << swapped.error();
  ASSERT_EQ(swapped->size(), 2u);
  EXPECT_NE(swapped->front().find("are vx_mps and vz_mps exchanged"), std::string::npos) << swapped->front();
}

TEST(NearestUnit, IsHalfTheWayToTheNextOneThatATableMayBeIn) {
  EXPECT_NEAR(nearest_unit("vx_mps", "x_m"), std::sqrt(3600 / 1852.0), 1e-12);
  EXPECT_NEAR(nearest_unit("ax_mps2", "x_m"), std::sqrt(1 / 0.3048), 1e-12);
}

}  // namespace
}  // namespace backwash::log

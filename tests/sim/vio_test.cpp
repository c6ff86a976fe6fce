// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/vehicle/vio.hpp"

#include <gtest/gtest.h>

namespace backwash::sim {
namespace {

const State kTruth{.p_W = Vec3(1, -2, 3), .v_W = Vec3(0.5, 0.1, -0.2)};

TEST(EmulatedVio, DriftsWithinItsBoundAndUsesIt) {
  double largest = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const EmulatedVio vio(0.015, seed);
    for (double t = 0; t < 600; t += 0.1)
      largest = std::max(largest, (vio.estimate(kTruth, t).p_W - kTruth.p_W).norm());
  }
  EXPECT_LE(largest, 0.015);
  EXPECT_GT(largest, 0.010);
}

TEST(EmulatedVio, VelocityErrorIsTheDerivativeOfThePositionErrorAndSlow) {
  const EmulatedVio vio(0.015, 7);
  for (double t = 0; t < 100; t += 0.37) {
    const Vec3 slope = (vio.estimate(kTruth, t + 1e-4).p_W - vio.estimate(kTruth, t - 1e-4).p_W) / 2e-4;
    const Vec3 v = vio.estimate(kTruth, t).v_W - kTruth.v_W;
    EXPECT_LT((v - slope).norm(), 1e-8);
    EXPECT_LE(v.norm(), 2 * 3.14159266 * 0.2 * 0.015);  // a bound B at 0.2 Hz at most
  }
}

TEST(EmulatedVio, RepeatsBySeed) {
  const EmulatedVio a(0.02, 3), b(0.02, 3), c(0.02, 4);
  EXPECT_EQ(a.estimate(kTruth, 12.3).p_W, b.estimate(kTruth, 12.3).p_W);
  EXPECT_NE(a.estimate(kTruth, 12.3).p_W, c.estimate(kTruth, 12.3).p_W);
}

}  // namespace
}  // namespace backwash::sim

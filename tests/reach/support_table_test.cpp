// SPDX-License-Identifier: BSD-3-Clause
// Supports that are summed from a loop's table of responses: beyond its end, and by axis and direction.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/reach/support.hpp"
#include "tests/reach/axis_rollouts.hpp"

namespace backwash::reach {
namespace {

using Batch = AxisRollouts::Batch;

TEST(SupportRecursion, BeyondTheTableTheTailKeepsTheSumCovered) {
  Vehicle vehicle;
  vehicle.controller.attitude_lag = 0.05;  // a loop that the FIR serves
  vehicle.controller.kp = {20, 20};
  vehicle.controller.kd = {4, 4};
  const AxisLoop axis = axis_loop(vehicle, false, Loop::vehicle);
  const AxisResponse response = axis_response(axis, Loop::vehicle);
  SupportRecursion support(response, response, vehicle);
  DisturbanceBound b;
  b.w.fill(2);
  const std::size_t N = response.G.size();
  for (std::size_t k = 0; k < 3 * N + 5; ++k) {
    support.step(b);
    const double least = 2 * response.P[std::min(k + 1, N) * AxisResponse::kPhases];
    ASSERT_GE(support.half_widths()[kX], least - 1e-14);
    ASSERT_LE(support.half_widths()[kX], least + 2 * response.tail + 1e-14);
    ASSERT_EQ(support.half_widths()[kX], support.half_widths()[kXyMinus]);
  }
  // A storm in the past: what is left of it is never forgotten altogether.
  for (std::size_t k = 0; k < N + 3; ++k) support.step(DisturbanceBound{});
  EXPECT_GT(support.half_widths()[kZ], 0);
  EXPECT_LE(support.half_widths()[kZ], 2 * response.tail);
}

TEST(SupportRecursion, BeyondTheTableTheFirstErrorsAreStillCovered) {
  Vehicle vehicle;
  vehicle.controller.attitude_lag = 0.05;
  vehicle.controller.feedback_delay = 0;
  vehicle.controller.kp = {20, 20};
  vehicle.controller.kd = {4, 4};
  const AxisLoop axis = axis_loop(vehicle, false, Loop::vehicle);
  const AxisResponse response = axis_response(axis, Loop::vehicle);
  for (const auto& [position, velocity] : {std::pair(1.0, 0.0), std::pair(0.0, 1.0)}) {
    vehicle.initial_error = {position, velocity};
    SupportRecursion support(response, response, vehicle);
    AxisRollouts e(axis, false, kRolloutStep, Batch{{position}}, Batch{{velocity}});
    for (std::size_t k = 0; k < response.G.size() + 40; ++k) {
      support.step(DisturbanceBound{});
      for (int i = 0; i < kRolloutSteps; ++i) e.step(Batch{{0.0}});
      ASSERT_GE(support.half_widths()[kX], (1 - 1e-3) * std::abs(e.p()[0])) << "step " << k;
    }
  }
}

TEST(SupportRecursion, AxesAndDirectionsAreTheirOwn) {
  Vehicle vehicle;
  vehicle.controller.kp = {6, 16};
  vehicle.controller.kd = {4, 8};
  const AxisResponse horizontal = axis_response(axis_loop(vehicle, false, Loop::continuous), Loop::continuous);
  const AxisResponse vertical = axis_response(axis_loop(vehicle, true, Loop::continuous), Loop::continuous);
  SupportRecursion support(horizontal, vertical, vehicle);
  const DisturbanceBound b{{0.5, 1, 2, 3, 4}};
  for (int k = 0; k < 400; ++k) support.step(b);
  const PerDirection h = support.half_widths();
  const double closed_form = 0.170633990;  // (6, 4), see AxisResponse.HoverHalfWidthIsTheClosedForm
  EXPECT_NEAR(h[kX], 0.5 * closed_form, 1e-6);
  EXPECT_NEAR(h[kY], closed_form, 1e-6);
  EXPECT_NEAR(h[kXyPlus], 3 * closed_form, 1e-6);
  EXPECT_NEAR(h[kXyMinus], 4 * closed_form, 1e-6);
  EXPECT_NEAR(h[kZ], 2.0 / 16, 1e-6);
}

}  // namespace
}  // namespace backwash::reach

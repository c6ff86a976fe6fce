// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/reach/axis_rollouts.hpp"

namespace backwash::reach {
namespace {

using Batch = AxisRollouts::Batch;

struct Case {
  Vehicle vehicle;
  Loop loop;
  AxisLoop axis() const { return axis_loop(vehicle, false, loop); }
  bool sampled() const { return loop == Loop::sampled; }
  AxisResponse response;
};

// Every gain set under every loop that flies it. All of them are stable (asserted by the first test).
std::vector<Case> cases() {
  std::vector<Case> all;
  for (const auto& [kp, kd] : kGainSets)
    for (const auto& [loop, lag, delay] :
         {std::tuple(Loop::continuous, 0.05, 0.03), std::tuple(Loop::vehicle, 0.05, 0.0),
          std::tuple(Loop::vehicle, 0.05, 0.03), std::tuple(Loop::vehicle, 0.0, 0.03),
          std::tuple(Loop::sampled, 0.0, 0.0), std::tuple(Loop::sampled, 0.05, 0.03)}) {
      Case c{{}, loop, {}};
      c.vehicle.controller.kp = {kp, kp};
      c.vehicle.controller.kd = {kd, kd};
      c.vehicle.controller.attitude_lag = lag;
      c.vehicle.controller.feedback_delay = delay;
      c.vehicle.initial_error.position = 0.02;
      c.vehicle.initial_error.velocity = 0.05;
      c.response = axis_response(c.axis(), loop);
      all.push_back(std::move(c));
    }
  return all;
}

std::string name(const Case& c) {
  const AxisLoop axis = c.axis();
  return (c.sampled() ? "sampled, gains " : "continuous feedback, gains ") + std::to_string(axis.kp) + " " +
         std::to_string(axis.kd) + ", delay " + std::to_string(axis.feedback_delay) + ", lag " +
         std::to_string(axis.attitude_lag);
}

// Variances that vary as along a flight: smooth, with jumps and quiet stretches.
std::vector<Variance> varying_variances(std::mt19937& random, std::size_t steps) {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Variance> variances(steps);
  double level = 1;
  for (Variance& sigma : variances) {
    if (uniform(random) < 0.05) level = uniform(random) < 0.3 ? 0 : 2.5 * uniform(random);
    const double x = level * (0.8 + 0.4 * uniform(random)), y = level * (0.5 + uniform(random));
    const double correlation = 0.6 * (2 * uniform(random) - 1);
    sigma = {x * x, correlation * x * y, 0, y * y, 0, level * level};
  }
  return variances;
}

// One standard deviation: the slabs around the ellipsoid {w : wᵀ Σ⁻¹ w ≤ 1}.
std::vector<DisturbanceBound> bounds_of(const std::vector<Variance>& variances) {
  std::vector<DisturbanceBound> bounds;
  for (const Variance& sigma : variances) bounds.push_back(bound(sigma, BoundModel{1, 0, 0, 0.15}));
  return bounds;
}
std::vector<DisturbanceBound> varying_bounds(std::mt19937& random, std::size_t steps) {
  return bounds_of(varying_variances(random, steps));
}

struct Tube {
  std::vector<PerDirection> at, until_next;
};
Tube propagate(const Case& c, const std::vector<DisturbanceBound>& bounds) {
  SupportRecursion support(c.response, c.response, c.vehicle);
  Tube tube;
  for (const DisturbanceBound& b : bounds) {
    tube.at.push_back(support.half_widths());
    tube.until_next.push_back(support.half_widths_until_next(b));
    support.step(b);
  }
  tube.at.push_back(support.half_widths());
  return tube;
}

// Position at every 2 ms after a unit push of 2 ms that starts at each of the ten instants of a step: by superposition
// the position at any time under any disturbance that is constant for 2 ms.
struct PushResponse {
  PushResponse(const Case& c, std::size_t steps) {
    AxisRollouts push(c.axis(), c.sampled(), kRolloutStep, Batch::Zero(kRolloutSteps), Batch::Zero(kRolloutSteps));
    AxisRollouts initial(c.axis(), c.sampled(), kRolloutStep, Batch{{1, 0}}, Batch{{0, 1}});
    for (std::size_t i = 0; i <= steps * kRolloutSteps; ++i) {
      position.push_back(push.p());
      from_initial.push_back(initial.p());
      Batch w = Batch::Zero(kRolloutSteps);
      if (i < kRolloutSteps) w[static_cast<Eigen::Index>(i)] = 1;
      push.step(w);
      initial.step(Batch{{0, 0}});
    }
  }
  // At time `to` (in 2 ms) after the push of the 2 ms that start at `from`.
  double at(std::size_t from, std::size_t to) const {
    return position[to - from / kRolloutSteps * kRolloutSteps][static_cast<Eigen::Index>(from % kRolloutSteps)];
  }
  std::vector<Batch> position, from_initial;
};

// The start and the bang-bang disturbance that push farthest at time `to`.
struct WorstCase {
  double p0, v0;
  std::vector<double> sign;
};
WorstCase worst_case(const Case& c, const PushResponse& response, std::size_t to) {
  const double p = c.vehicle.initial_error.position, v = c.vehicle.initial_error.velocity;
  const Batch& r = response.from_initial[to];
  const double norm = std::hypot(p * r[0], v * r[1]);
  WorstCase worst{p * p * r[0] / norm, v * v * r[1] / norm, {}};
  for (std::size_t i = 0; i < to; ++i) worst.sign.push_back(response.at(i, to) < 0 ? -1 : 1);
  return worst;
}

// Along a direction n the farthest push of the ellipsoid is Σn/√(nᵀΣn), which lies in every slab.
Vec3 farthest_push(const Variance& sigma, Direction d) {
  const Vec3 n = unit(d);
  const Vec3 push(sigma.xx * n.x() + sigma.xy * n.y(), sigma.xy * n.x() + sigma.yy * n.y(), sigma.zz * n.z());
  const double along = n.dot(push);
  return along > 0 ? Vec3(push / std::sqrt(along)) : Vec3::Zero();
}

TEST(SupportRecursion, IsReachedByTheWorstDisturbanceOfEachDirectionAndNeverLeft) {
  constexpr std::size_t kSteps = 100;
  constexpr Eigen::Index kTimes = 340;  // over the six loops: 2,040 per gain set
  std::mt19937 random(11);
  std::uniform_int_distribution<std::size_t> any_step(3, kSteps), any_instant(30, kSteps * kRolloutSteps - 1);
  for (const Case& c : cases()) {
    const auto variances = varying_variances(random, kSteps);
    const Tube tube = propagate(c, bounds_of(variances));
    const PushResponse response(c, kSteps);
    std::vector<std::size_t> times;  // half of them at samples
    std::vector<WorstCase> worst;
    const auto direction_of = [](Eigen::Index n) { return static_cast<Direction>(n / 2 % kDirections); };
    std::array<Batch, 3> p0, v0;
    for (std::size_t axis = 0; axis < 3; ++axis) p0[axis] = v0[axis] = Batch::Zero(kTimes);
    for (Eigen::Index n = 0; n < kTimes; ++n) {
      times.push_back(n % 2 == 0 ? any_step(random) * kRolloutSteps : any_instant(random));
      worst.push_back(worst_case(c, response, times.back()));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        p0[axis][n] = worst.back().p0 * unit(direction_of(n))[static_cast<Eigen::Index>(axis)];
        v0[axis][n] = worst.back().v0 * unit(direction_of(n))[static_cast<Eigen::Index>(axis)];
      }
    }
    std::array<AxisRollouts, 3> e{AxisRollouts(c.axis(), c.sampled(), kRolloutStep, p0[0], v0[0]),
                                  AxisRollouts(c.axis(), c.sampled(), kRolloutStep, p0[1], v0[1]),
                                  AxisRollouts(c.axis(), c.sampled(), kRolloutStep, p0[2], v0[2])};
    for (std::size_t i = 0; i <= kSteps * kRolloutSteps; ++i) {
      const std::size_t k = std::min(i / kRolloutSteps, kSteps - 1);
      for (std::size_t d = 0; d < kDirections; ++d) {
        const Vec3 m = unit(static_cast<Direction>(d));
        const Batch along = m.x() * e[0].p() + m.y() * e[1].p() + m.z() * e[2].p();
        const double largest = along.abs().maxCoeff();
        ASSERT_LE(largest, tube.until_next[k][d] * (1 + 1e-7)) << name(c) << " at " << i;
        if (i % kRolloutSteps != 0) continue;
        ASSERT_LE(largest, tube.at[i / kRolloutSteps][d] * (1 + 1e-7)) << name(c) << " at " << i;
        for (Eigen::Index n = 0; n < kTimes; ++n)
          if (direction_of(n) == d && i == times[static_cast<std::size_t>(n)]) {
            ASSERT_GE(along[n], 0.999 * tube.at[i / kRolloutSteps][d]) << name(c) << " at " << i << " direction " << d;
          }
      }
      if (i == kSteps * kRolloutSteps) break;
      std::array<Batch, 3> w{Batch(kTimes), Batch(kTimes), Batch(kTimes)};
      std::array<Vec3, kDirections> push;
      for (std::size_t d = 0; d < kDirections; ++d) push[d] = farthest_push(variances[k], static_cast<Direction>(d));
      for (Eigen::Index n = 0; n < kTimes; ++n) {
        const auto& sign = worst[static_cast<std::size_t>(n)].sign;
        for (std::size_t axis = 0; axis < 3; ++axis)
          w[axis][n] = (i < sign.size() ? sign[i] : 1) * push[direction_of(n)][static_cast<Eigen::Index>(axis)];
      }
      for (std::size_t axis = 0; axis < 3; ++axis) e[axis].step(w[axis]);
    }
  }
}

// The support between samples, from its definition by superposition.
TEST(SupportRecursion, IntervalIsTheLargestSupportWithinHalfAPerCent) {
  constexpr std::size_t kSteps = 80;
  std::mt19937 random(3);
  for (const Case& c : cases()) {
    const auto bounds = varying_bounds(random, kSteps);
    const Tube tube = propagate(c, bounds);
    const PushResponse response(c, kSteps);
    for (std::size_t k = 0; k < kSteps; ++k) {
      double largest = 0;
      for (std::size_t to = k * kRolloutSteps; to <= (k + 1) * kRolloutSteps; ++to) {
        double h = std::hypot(c.vehicle.initial_error.position * response.from_initial[to][0],
                              c.vehicle.initial_error.velocity * response.from_initial[to][1]);
        for (std::size_t i = 0; i < to; ++i) h += bounds[i / kRolloutSteps].w[kX] * std::abs(response.at(i, to));
        largest = std::max(largest, h);
      }
      ASSERT_GE(tube.until_next[k][kX], largest * (1 - 1e-7)) << name(c) << " step " << k;
      ASSERT_LE(tube.until_next[k][kX], largest * 1.005) << name(c) << " step " << k;
    }
  }
}

}  // namespace
}  // namespace backwash::reach

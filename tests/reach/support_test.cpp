// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "core/reach/response/delay_recursion.hpp"
#include "core/reach/support.hpp"
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

// Supports that are summed from a loop's table of responses: beyond its end, and by axis and direction.

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

// The impulse response of the second-order loop, from its characteristic roots.
double impulse_response(double kp, double kd, double t) {
  const double sigma = kd / 2, under_root = kp - sigma * sigma;
  if (under_root > 0) return std::exp(-sigma * t) * std::sin(std::sqrt(under_root) * t) / std::sqrt(under_root);
  if (under_root == 0) return t * std::exp(-sigma * t);
  const double s = std::sqrt(-under_root);
  return (std::exp((s - sigma) * t) - std::exp(-(s + sigma) * t)) / (2 * s);
}

// ∫ |g| over each step, Simpson's rule on 2000 pieces.
std::vector<double> step_shares(double kp, double kd, std::size_t steps) {
  constexpr int kPieces = 2000;
  std::vector<double> G(steps);
  for (std::size_t j = 0; j < steps; ++j)
    for (int i = 0; i < kPieces; ++i) {
      const double h = kControlPeriod / kPieces, t = static_cast<double>(j) * kControlPeriod + h * i;
      const auto g = [&](double at) { return std::abs(impulse_response(kp, kd, at)); };
      G[j] += h / 6 * (g(t) + 4 * g(t + h / 2) + g(t + h));
    }
  return G;
}

std::vector<double> random_bounds(std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> w(count);
  for (double& x : w) x = uniform(random) < 0.3 ? 0 : 3 * uniform(random);
  return w;
}

AxisResponse fir_only(AxisResponse response) {
  response.delay.reset();
  return response;
}

TEST(DelayRecursion, IsTheConvolutionWithTheAbsoluteImpulseResponse) {
  constexpr std::size_t kSteps = 700;
  for (const auto& [kp, kd] : kGainSets) {
    SCOPED_TRACE(testing::Message() << kp << " " << kd);
    const AxisResponse response = axis_response({kp, kd, 0, 0}, Loop::continuous);
    ASSERT_TRUE(response.delay);
    EXPECT_EQ(response.delay->echoes.empty(), kd * kd >= 4 * kp);
    EXPECT_LE(response.delay->tail, 1e-6 * response.h_inf);
    const std::vector<double> G = step_shares(kp, kd, kSteps), w = random_bounds(kSteps, 5);
    SupportFilter<1> filter(response);
    for (std::size_t k = 1; k < kSteps; ++k) {
      const double sum = filter.push({w[k - 1]})[0];  // at (k + 1) dt, without step k
      double exact = 0;
      for (std::size_t j = 0; j < k; ++j) exact += w[j] * G[k - j];
      ASSERT_NEAR(sum, exact, filter.tail()[0] + 1e-9 * exact + 1e-13) << k;
      ASSERT_GE(sum + filter.tail()[0], exact - 1e-9 * exact) << k;
      if (static_cast<double>(k) * kControlPeriod < 1) {  // before any tail
        ASSERT_NEAR(sum, exact, 1e-9 * exact + 1e-13) << k;
      }
    }
  }
}

// The tail is needed: of pushes during the one half oscillation after the last echo, the truncated sum has the sign
// wrong.
TEST(DelayRecursion, TailCoversTheEchoesLeftOutAndLittleMore) {
  const AxisResponse response = axis_response({20, 4, 0, 0}, Loop::continuous);
  const double T = std::numbers::pi / 4;  // ω = 4
  const auto M = static_cast<double>(response.delay->echoes.size());
  const auto steps = static_cast<std::size_t>((M + 3) * T / kControlPeriod);
  const std::vector<double> G = step_shares(20, 4, steps + 1);
  SupportFilter<1> filter(response);
  double sum = 0, exact = 0;
  for (std::size_t k = 0; k < steps; ++k) {
    const double age = static_cast<double>(steps - k) * kControlPeriod;
    const double w = age >= (M + 1) * T && age + kControlPeriod <= (M + 2) * T ? 1 : 0;
    sum = filter.push({w})[0];
    exact += w * G[steps - k];
  }
  EXPECT_LE(exact - sum, response.delay->tail);
  EXPECT_GE(exact - sum, 0.5 * response.delay->tail);
  EXPECT_EQ(filter.tail()[0], response.delay->tail);
}

TEST(DelayRecursion, LeavesBarelyDampedAndVeryFastLoopsToTheFir) {
  EXPECT_TRUE(delay_recursion(20, 4));        // ζ = 0.45
  EXPECT_FALSE(delay_recursion(20, 1));       // ζ = 0.11
  EXPECT_FALSE(delay_recursion(40000, 200));  // half an oscillation in 18 ms
  EXPECT_TRUE(delay_recursion(16, 8)->echoes.empty());
  EXPECT_FALSE(axis_response({6, 4, 0, 0.05}, Loop::vehicle).delay);
  EXPECT_FALSE(axis_response({6, 4, 0.03, 0}, Loop::vehicle).delay);
  EXPECT_FALSE(axis_response({6, 4, 0, 0}, Loop::sampled).delay);
}

TEST(DelayRecursion, GivesTheSetsOfTheFir) {
  Vehicle vehicle;
  vehicle.initial_error.position = 0.02;
  vehicle.initial_error.velocity = 0.05;
  for (const auto& [kp, kd] : kGainSets) {
    const AxisResponse recursion = axis_response({kp, kd, 0, 0}, Loop::continuous), fir = fir_only(recursion);
    SupportRecursion a(recursion, recursion, vehicle), b(fir, fir, vehicle);
    const std::vector<double> w = random_bounds(2000, 9);
    for (std::size_t k = 0; k + 5 < w.size(); ++k) {
      const DisturbanceBound bound{{w[k], w[k + 1], w[k + 2], w[k + 3], w[k + 4]}};
      a.step(bound);
      b.step(bound);
      for (std::size_t d = 0; d < kDirections; ++d) {
        const double slack = 3 * (recursion.delay->tail + recursion.tail) + 1e-9 * b.half_widths()[d];
        ASSERT_NEAR(a.half_widths()[d], b.half_widths()[d], slack) << kp << " " << kd << " " << k;
        ASSERT_NEAR(a.half_widths_until_next(bound)[d], b.half_widths_until_next(bound)[d], slack);
      }
    }
  }
}

}  // namespace
}  // namespace backwash::reach

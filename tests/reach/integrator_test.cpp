// SPDX-License-Identifier: BSD-3-Clause
// What an integrator of the velocity loop holds: its kernel, the bound on the disturbance less what is held, and sets
// under it, against an integration of the loop that shares nothing with them.
#include "core/reach/response/integrator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/reach/chance.hpp"
#include "core/reach/hover_set.hpp"
#include "core/reach/reach_tube.hpp"
#include "core/types/minimum_jerk.hpp"
#include "tests/reach/charged_loop.hpp"

namespace backwash::reach {
namespace {

TEST(Integrator, HoldsOffASteadyPushAsItsKernelSays) {
  for (const double gain : {0.4, 2.0}) {
    const IntegratorResponse response = integrator_response(with_gain(gain));
    Loop1 loop(with_gain(gain));
    double cumulated = 0, largest = 0;
    std::size_t bin = 0;
    for (double t = 0; t < 40; t += kEuler) {
      loop.step(1);
      largest = std::max(largest, -loop.held);
      if (t + kEuler < 0.02 * static_cast<double>(bin + 1) || bin >= response.kernel.size()) continue;
      cumulated += response.kernel[bin] - 2 * response.opposite[bin];
      ++bin;
      ASSERT_NEAR(cumulated, -loop.held, 0.02) << t;
    }
    EXPECT_LT(std::hypot(loop.held + 1, loop.p), 2e-3);
    EXPECT_LE(largest, 1.01 + response.opposed());
    EXPECT_GT(largest, gain > 1 ? 1.02 : 0.99);  // the stronger overshoots: something is opposed
  }
}

TEST(Integrator, IsNoneWithoutItsGain) {
  AxisLoop axis = kAxis;
  axis.velocity_integrator = 0;
  EXPECT_TRUE(integrator_response(axis).kernel.empty());
  const OpenAir air;
  const NetDisturbance net(Reachability(vehicle_of(0)), air.bounds);
  EXPECT_FALSE(net.held());
  EXPECT_EQ(net(air.bounds.largest()).w, air.bounds.largest().w);
}

TEST(Integrator, RefusesWhatNeverSettlesAndWhatDoesNotKnowIt) {
  AxisLoop axis = kAxis;
  axis.velocity_integrator = 8;
  EXPECT_THROW(integrator_response(axis), std::invalid_argument);
  axis.velocity_integrator = 1e-3;
  EXPECT_THROW(integrator_response(axis), std::invalid_argument);
  EXPECT_THROW(Reachability(vehicle_of(0.4), Method::tight, Loop::sampled), std::invalid_argument);
  const OpenAir air;
  const Reachability reach(vehicle_of(0.4));
  const std::vector<Setpoint> commands(5);
  EXPECT_THROW(chance_tube_over_field(reach, {}, {}, commands, air.bounds, air.bounds.model(), 1e-3),
               std::invalid_argument);
}

TEST(Integrator, ManoeuvresChargeItByNoMoreThanSaidAndSomeByThat) {
  const IntegratorResponse response = integrator_response(kAxis);
  std::mt19937 random(7);
  double largest = 0;
  for (int trial = 0; trial < 40; ++trial) {
    Loop1 loop(kAxis);
    double p = 0, v = 0, a = 1, left = 0, most = 0;
    const double mean_length = std::exponential_distribution(0.3)(random) + 0.3;
    for (double t = 0; t < 60; t += kEuler, left -= kEuler) {
      if (left <= 0) {
        a = -a;
        left = std::exponential_distribution(1 / mean_length)(random);
      }
      loop.step(0, p, v, a);
      p += kEuler * v + kEuler * kEuler / 2 * a;
      v += kEuler * a;
      most = std::max(most, std::abs(loop.held));
    }
    largest = std::max(largest, most);
    ASSERT_LE(most, response.manoeuvre);
  }
  EXPECT_GT(largest, 0.5 * response.manoeuvre);
}

TEST(Integrator, ErrorsAtTheStartChargeItByAsMuchAsSaid) {
  const IntegratorResponse response = integrator_response(kAxis);
  for (const bool of_position : {true, false}) {
    Loop1 loop(kAxis);
    (of_position ? loop.p : loop.v) = 1;
    for (double t = 0; t < kAxis.feedback_delay; t += kEuler) {  // what was measured before the start
      const double p = loop.p, v = loop.v;
      loop.step(0);
      loop.p = p;
      loop.v = v;
      loop.a = loop.held = 0;
    }
    double most = 0;
    for (double t = 0; t < 20; t += kEuler) {
      loop.step(0);
      most = std::max(most, std::abs(loop.held));
    }
    EXPECT_NEAR(of_position ? response.from_position : response.from_velocity, 1.01 * most, 0.03 * most) << of_position;
  }
}

/// Pushes that change their side now and then, between least and most.
struct Switching {
  double least, most, push = 0, left = 0;
  double next(std::mt19937& random, double mean_length) {
    if ((left -= kEuler) <= 0) {
      push = std::bernoulli_distribution(0.5)(random) ? most : least;
      left = std::exponential_distribution(1 / mean_length)(random);
    }
    return push;
  }
};

TEST(Integrator, SteadyPushesLessWhatIsHeldStayWithinTheirBound) {
  // A known push of 0 … 0.3 m/s² and one of unknown sign up to 0.1 m/s²; the gusts' part is taken off.
  const OpenAir air(Vec3(0.3, 0, 0), 0.1);
  for (const double gain : {0.4, 2.0}) {
    Vehicle vehicle = vehicle_of(gain);
    vehicle.limits.a_max = 0;
    const NetDisturbance net(Reachability(vehicle), air.bounds);
    DisturbanceBound none;
    none.w.fill(0.1);
    const OpenAir calm(Vec3(0.3, 0, 0), 0.1, 0);
    const double bound = NetDisturbance(Reachability(vehicle), calm.bounds)(none).w[kX];
    std::mt19937 random(11);
    double largest = 0;
    for (int trial = 0; trial < 60; ++trial) {
      Loop1 loop(with_gain(gain));
      Switching known{0, 0.3}, unknown{-0.1, 0.1};
      const double mean_length = trial % 3 == 0 ? 1 : trial % 3 == 1 ? 5 : 30;
      for (double t = 0; t < 120; t += kEuler) {
        const double w = known.next(random, mean_length) + unknown.next(random, mean_length);
        loop.step(w);
        largest = std::max(largest, std::abs(w + loop.held));
        ASSERT_LE(std::abs(w + loop.held), bound);
      }
    }
    EXPECT_GT(largest, 0.8 * bound) << gain;
    EXPECT_GT(net(none).w[kX], bound);  // gusts are held, too
  }
}

/// What is held after an impulse of 1 m/s, by age in steps of kEuler.
std::vector<double> held_after_a_hit(double gain) {
  Loop1 loop(with_gain(gain));
  loop.step(1 / kEuler);
  std::vector<double> held;
  for (double t = 0; t < 30; t += kEuler) {
    held.push_back(loop.held);
    loop.step(0);
  }
  return held;
}

Reachability at_rest(double gain) {
  Vehicle vehicle = vehicle_of(gain);
  vehicle.controller.velocity_integrator.vertical = 1;
  vehicle.limits.a_max = 0;
  vehicle.initial_error = {0, 0};
  return Reachability(vehicle);
}

// At each moment the side that what is held now takes over worst: the bound is reached, its overshoot too.
TEST(Integrator, PushesThatMakeItsOvershootAddToThemReachTheBound) {
  constexpr double kGain = 4, kKnown = 0.3, kUnknown = 0.1;
  const std::vector<double> held = held_after_a_hit(kGain);
  Loop1 loop(with_gain(kGain));
  for (std::size_t age = held.size(); age-- > 0;) loop.step(held[age] > 0 ? kKnown + kUnknown : -kUnknown);

  DisturbanceBound none;
  none.w.fill(kUnknown);
  const OpenAir calm(Vec3(kKnown, 0, 0), kUnknown, 0);
  const double bound = NetDisturbance(at_rest(kGain), calm.bounds)(none).w[kX];
  const double net = kKnown + kUnknown + loop.held;
  EXPECT_LE(net, bound);
  EXPECT_GT(net, 0.98 * bound);
}

// Equation 4-17 by sums over the response: variance of what is held, and what of it works with the gust.
TEST(Integrator, TheBoundOnGustsIsTheEquations) {
  constexpr double kGain = 4, kTau = 3, kGusts = 0.3, kHere = 0.5;  // m/s²: deviation everywhere; bound here
  double before = 0, squared = 0, with = 0, age = 1;
  for (const double held : held_after_a_hit(kGain)) {
    const double c = kEuler * std::abs(held);
    squared += c * (c + 2 * before);
    before = (before + c) * std::exp(-kEuler / kTau);
    with += age * std::max(0.0, kEuler * held);
    age *= std::exp(-kEuler / kTau);
  }
  DisturbanceBound here;
  here.w.fill(kHere);
  const OpenAir air(Vec3::Zero(), 0, kGusts, kTau);
  const double most = 3 * kGusts, said = NetDisturbance(at_rest(kGain), air.bounds)(here).w[kX];
  const double expected = std::sqrt(kHere * (kHere + 2 * with * most) + squared * most * most);
  EXPECT_GE(said, expected);
  EXPECT_LT(said, 1.03 * expected);
  EXPECT_GT(expected, 1.02 * std::sqrt(kHere * kHere + squared * most * most)) << "what works with the gust counts";
}

TEST(Integrator, GustsLessWhatIsHeldHaveNoMoreThanTheSaidDeviation) {
  // Rough air of deviation 0.3 for 10 s, then calm air of 0.1: what is held of the rough one is still there.
  constexpr double kRough = 0.3, kCalm = 0.1, kTau = 0.15;
  constexpr int kMotions = 1500;
  const OpenAir air(Vec3::Zero(), 0, kRough);
  Vehicle vehicle = vehicle_of(0.4);
  vehicle.limits.a_max = 0;
  const NetDisturbance net(Reachability(vehicle), air.bounds);
  DisturbanceBound calm, rough;
  calm.w.fill(3 * kCalm);
  rough.w.fill(3 * kRough);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const double keep = std::exp(-kEuler / kTau);
  double in_rough = 0, in_calm = 0;
  for (int motion = 0; motion < kMotions; ++motion) {
    Loop1 loop(kAxis);
    double xi = normal(random), w = 0;
    const auto blow = [&](double seconds, double deviation) {
      for (double t = 0; t < seconds; t += kEuler) {
        w = deviation * xi;
        loop.step(w);
        xi = keep * xi + std::sqrt(1 - keep * keep) * normal(random);
      }
      return std::pow(w + loop.held, 2) / kMotions;
    };
    in_rough += blow(10, kRough);
    in_calm += blow(0.5, kCalm);
  }
  const double error = 3 / std::sqrt(2.0 * kMotions);  // of a deviation, three standard errors
  EXPECT_LE(std::sqrt(in_rough), net(rough).w[kX] / 3 * (1 + error));
  EXPECT_LE(std::sqrt(in_calm), net(calm).w[kX] / 3 * (1 + error));
  EXPECT_GT(std::sqrt(in_calm), 1.05 * kCalm);  // the memory is there
  EXPECT_LT(net(rough).w[kX], 1.2 * 3 * kRough);
}

TEST(Integrator, AHoverRestsOnItsSetPointAndItsSetHoldsThePush) {
  const Vec3 push(0.3, 0, 0);
  const OpenAir pushed(push), still;
  const auto set_of = [](double integrator, const OpenAir& air) {
    return hover_extent(Reachability(vehicle_of(integrator)), air.grid, air.distance, air.bounds,
                        Vec3(0.25, 0.25, 0.25));
  };
  EXPECT_NEAR(set_of(0, pushed).shift.x(), 0.3 / kAxis.kp, 1e-9);
  const HoverSet held = set_of(0.4, pushed);
  ASSERT_TRUE(held.bounded);
  EXPECT_EQ(held.shift, Vec3::Zero());
  // The push may set in: the set grows by what it moves the craft before it is held.
  Loop1 loop(kAxis);
  double farthest = 0;
  for (double t = 0; t < 20; t += kEuler) {
    loop.step(push.x());
    farthest = std::max(farthest, loop.p);
  }
  EXPECT_GE(held.half_widths[kX] - set_of(0.4, still).half_widths[kX], farthest);
  EXPECT_GT(farthest, std::abs(loop.p) + 0.1);
}

TEST(Integrator, FlightsStayInTheirTubeWhileThePushComesAndGoes) {
  const OpenAir air(Vec3(0.3, 0, 0), 0.05);
  const Vehicle vehicle = vehicle_of(0.4);
  const Reachability reach(vehicle);
  std::vector<Setpoint> commands;  // 2 m in 4 s and back to rest, within 1 m/s²
  for (int k = 0; k < 400; ++k) {
    const auto [s, v, a] = minimum_jerk(std::min(0.02 * k, 4.0) / 4);
    Setpoint c;
    c.p_W.x() = -1 + 2 * s;
    c.v_W.x() = 2 * v / 4;
    c.a_W.x() = 2 * a / 16;
    commands.push_back(c);
  }
  State start;
  start.p_W.x() = -1;
  const ReachTube tube = tube_over_field(reach, start, commands.front(), commands, air.bounds);
  std::mt19937 random(3);
  double nearest = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Loop1 loop(kAxis);
    loop.p = -1;
    Switching known{0, 0.3}, unknown{-0.05, 0.05}, gust{-0.3, 0.3};
    // The charge of the start: of hovering in some push.
    for (double t = 0; t < 30; t += kEuler) loop.step(known.next(random, 8) + unknown.next(random, 8), -1);
    loop.p = -1;
    loop.v = 0;
    for (std::size_t k = 0; k < commands.size(); ++k) {
      const Setpoint& c = commands[k];
      for (double t = 0; t < 0.02 - kEuler / 2; t += kEuler)
        loop.step(known.next(random, 4) + unknown.next(random, 4) + gust.next(random, 0.15), c.p_W.x(), c.v_W.x(),
                  c.a_W.x());
      const double share = std::abs(loop.p - tube[k + 1].center.p_W.x()) / tube[k + 1].half_widths[kX];
      nearest = std::max(nearest, share);
      ASSERT_LE(share, 1) << k;
    }
  }
  EXPECT_GT(nearest, 0.4);
}

}  // namespace
}  // namespace backwash::reach

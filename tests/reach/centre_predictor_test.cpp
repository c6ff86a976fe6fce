// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <stdexcept>
#include <vector>

#include "core/reach/response/error_dynamics.hpp"
#include "core/reach/response/integrator.hpp"
#include "tests/reach/axis_rollouts.hpp"

namespace backwash::reach {
namespace {

Vehicle vehicle_with(double latency, double delay, double lag) {
  Vehicle vehicle;
  vehicle.controller.kp = {10, 20};
  vehicle.controller.kd = {5.5, 6};
  vehicle.controller.latency = latency;
  vehicle.controller.feedback_delay = delay;
  vehicle.controller.attitude_lag = lag;
  return vehicle;
}

std::vector<Setpoint> random_commands(std::mt19937& random, std::size_t count) {
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Vec3(normal(random), normal(random), normal(random)); };
  std::vector<Setpoint> commands;
  for (std::size_t k = 0; k < count; ++k) {
    if (k % 7 == 0) {
      commands.push_back({vector(), vector(), vector(), 0});
    } else {
      commands.push_back(commands.back());
      commands.back().p_W += 0.05 * vector();
    }
  }
  return commands;
}

// Largest deviation of position (m) from fine integration, in which the command switches at k·20 ms + latency.
double deviation(const Vehicle& vehicle, Loop loop, std::size_t periods) {
  constexpr double h = 1e-4;
  constexpr int kPerPeriod = 200;
  std::mt19937 random(21);
  const auto commands = random_commands(random, periods + 1);
  const Setpoint& previous = commands.back();
  const State start{Vec3(0.3, -0.2, 1), Vec3(0.5, 0.1, -0.3)};
  const Vec3 a(0.4, -0.6, 0.2);
  CentrePredictor predictor(vehicle, loop, start, a, previous);

  std::vector<AxisRollouts> axes;
  for (int axis = 0; axis < 3; ++axis)
    axes.emplace_back(axis_loop(vehicle, axis == 2, loop), loop == Loop::sampled, h, Eigen::ArrayXd{{start.p_W[axis]}},
                      Eigen::ArrayXd{{start.v_W[axis]}}, Eigen::ArrayXd{{a[axis]}});
  const auto latency = std::lround(vehicle.controller.latency / h);
  double worst = 0;
  for (std::size_t k = 0; k < periods; ++k) {
    predictor.step(commands[k]);
    for (long i = static_cast<long>(k) * kPerPeriod; i < static_cast<long>(k + 1) * kPerPeriod; ++i) {
      const Setpoint& active = i < latency ? previous : commands[static_cast<std::size_t>((i - latency) / kPerPeriod)];
      for (int axis = 0; axis < 3; ++axis) {
        const AxisLoop loop_of_axis = axis_loop(vehicle, axis == 2, loop);
        const double r = loop_of_axis.kp * active.p_W[axis] + loop_of_axis.kd * active.v_W[axis] + active.a_W[axis];
        axes[static_cast<std::size_t>(axis)].step(Eigen::ArrayXd{{0.0}}, Eigen::ArrayXd{{r}});
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      const AxisRollouts& x = axes[static_cast<std::size_t>(axis)];
      worst = std::max({worst, std::abs(x.p()[0] - predictor.state().p_W[axis]),
                        0.1 * std::abs(x.v()[0] - predictor.state().v_W[axis])});
      // With lag the acceleration is a state; without, one of the command's sides is as good as the other.
      if (vehicle.controller.attitude_lag > 0 && loop != Loop::continuous)
        worst = std::max(worst, 0.01 * std::abs(x.a()[0] - predictor.acceleration()[axis]));
    }
  }
  return worst;
}

TEST(CentrePredictor, EqualsIndependentIntegrationForEveryLatency) {
  for (const double lag : {0.0, 0.05, 0.012})
    for (const double latency : {0.0, 0.013, 0.02, 0.0467, 0.06, 0.32})
      for (const Loop loop : {Loop::vehicle, Loop::continuous})
        EXPECT_LT(deviation(vehicle_with(latency, 0, lag), loop, 30), 1e-9) << "lag " << lag << " latency " << latency;
}

TEST(CentrePredictor, EqualsIndependentIntegrationWithDelayedFeedback) {
  for (const double lag : {0.05, 0.0})
    for (const double delay : {0.03, 0.0124, 0.0005, 0.02, 0.0611})
      for (const double latency : {0.0, 0.02, 0.0331})
        // Commands that jump by 10 m/s² and more: without lag what is fed back has kinks.
        EXPECT_LT(deviation(vehicle_with(latency, delay, lag), Loop::vehicle, 30), 1e-7)
            << "lag " << lag << " delay " << delay << " latency " << latency;
}

TEST(CentrePredictor, EqualsIndependentIntegrationWithSampledFeedback) {
  for (const double lag : {0.0, 0.05})
    for (const double delay : {0.0, 0.0124, 0.02, 0.03})
      for (const double latency : {0.0, 0.0076, 0.02, 0.031})
        EXPECT_LT(deviation(vehicle_with(latency, delay, lag), Loop::sampled, 30), 1e-9)
            << "lag " << lag << " delay " << delay << " latency " << latency;
}

TEST(CentrePredictor, StaysWhereItIsCommandedToBe) {
  const State hover{Vec3(1, 2, 3), Vec3::Zero()};
  const Setpoint command{hover.p_W};
  for (const Loop loop : {Loop::vehicle, Loop::continuous, Loop::sampled}) {
    const Vehicle vehicle = vehicle_with(0.033, 0.0124, 0.05);
    EXPECT_EQ(commanded_acceleration(vehicle, hover, command), Vec3::Zero());
    CentrePredictor predictor(vehicle, loop, hover, Vec3::Zero(), command);
    for (int k = 0; k < 100; ++k) predictor.step(command);
    EXPECT_LT((predictor.state().p_W - hover.p_W).norm(), 1e-12);
    EXPECT_LT(predictor.state().v_W.norm(), 1e-12);
  }
}

TEST(CentrePredictor, BegunAgainInFlightIsAsOneThatIsMadeThere) {
  std::mt19937 random(3);
  const auto commands = random_commands(random, 60);
  const State start{{1, 2, 3}, {0.3, -0.2, 0.1}};
  for (const Loop loop : {Loop::vehicle, Loop::continuous, Loop::sampled}) {
    const Vehicle vehicle = vehicle_with(0.033, 0.0124, 0.05);
    CentrePredictor begun(vehicle, loop, {}, Vec3::Zero(), {});
    for (const auto& command : commands) begun.step(command, Vec3(0.1, 0.2, 0.3));
    begun.begin(start, Vec3::Ones(), commands[0]);
    CentrePredictor made(vehicle, loop, start, Vec3::Ones(), commands[0]);
    for (const auto& command : commands) {
      const State a = begun.step(command), b = made.step(command);
      ASSERT_EQ(a.p_W, b.p_W);
      ASSERT_EQ(a.v_W, b.v_W);
    }
  }
}

TEST(CentrePredictor, RefusesLatenciesItCannotHold) {
  EXPECT_NO_THROW(CentrePredictor(vehicle_with(0.32, 0, 0), Loop::vehicle, {}, Vec3::Zero(), {}));
  EXPECT_THROW(CentrePredictor(vehicle_with(0.33, 0, 0), Loop::vehicle, {}, Vec3::Zero(), {}), std::invalid_argument);
  EXPECT_THROW(CentrePredictor(vehicle_with(-0.01, 0, 0), Loop::vehicle, {}, Vec3::Zero(), {}), std::invalid_argument);
  EXPECT_THROW(CentrePredictor(vehicle_with(0, 0.4, 0), Loop::vehicle, {}, Vec3::Zero(), {}), std::invalid_argument);
}

// What held set-points charge the integrator of a loop that has neither delay nor lag: its own integration is the
// oracle.

TEST(HeldCommands, ChargeALoopWithoutDelayByNoMoreThanIsSaid) {
  // Their place and velocity lag the acceleration by 10 ms on the mean.
  constexpr double kStep = 2.5e-4;  // s
  constexpr int kHeld = 80;         // steps of 20 ms
  const AxisLoop axis{7, 4.5, 0, 0, 4};
  double largest = 0;
  for (const int half : {25, 50, 100, 200}) {  // set-points for which the acceleration keeps its sign
    double p_cmd = 0, v_cmd = 0, p = 0, v = 0, held = 0;
    for (int k = 0; k < 1000; ++k) {
      const double a_cmd = k / half % 2 == 0 ? 1 : -1;
      for (int i = 0; i < kHeld; ++i) {
        const double off = axis.kp * (p_cmd - p) + axis.kd * (v_cmd - v);
        const double a = a_cmd + off + held;
        held += kStep * axis.velocity_integrator / axis.kd * off;
        p += kStep * (v + kStep / 2 * a);
        v += kStep * a;
        largest = std::max(largest, std::abs(held));
      }
      p_cmd += 0.02 * v_cmd + 0.0002 * a_cmd;
      v_cmd += 0.02 * a_cmd;
    }
  }
  const double said = integrator_response(axis).manoeuvre;
  EXPECT_LE(largest, said);
  EXPECT_GT(largest, 0.4 * said);
}

}  // namespace
}  // namespace backwash::reach

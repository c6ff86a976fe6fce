// SPDX-License-Identifier: BSD-3-Clause
// The loop that is simulated, that sets are predicted with and that logs are read with is one.
#include "core/study/windows/loop.hpp"

#include <gtest/gtest.h>

#include "core/config/config.hpp"
#include "core/reach/error_dynamics.hpp"
#include "core/sim/quadrotor.hpp"
#include "core/types/minimum_jerk.hpp"

namespace backwash::study {
namespace {

TEST(Loop, IsOneForSimulationSetsAndLogs) {
  auto vehicle = config::load_vehicle("builtin:quad-5in").value();
  vehicle.controller.feedback_delay = 0.03;
  auto commands = rest_to_rest({0, 0, 1}, {2, 1, 1.5}, 1.5, 3);
  commands.resize(commands.size() + 100, commands.back());
  sim::Quadrotor quad(vehicle, {commands.front().p_W, Vec3::Zero()});
  reach::CentrePredictor centre(vehicle, reach::Loop::vehicle, quad.state(), Vec3::Zero(), commands.front());
  std::vector<double> t;
  std::vector<Vec3> p, v, a, predicted;
  for (const Setpoint& command : commands) {
    t.push_back(quad.time()), p.push_back(quad.state().p_W), v.push_back(quad.state().v_W);
    a.push_back(quad.acceleration()), predicted.push_back(centre.state().p_W);
    quad.command(command), centre.step(command);
    for (int i = 0; i < 20; ++i) quad.step(Vec3::Zero(), quad.state());
  }
  loop::PositionLoop loop(vehicle);
  loop.latency += kControlPeriod / 2;  // held: half a period later on the mean
  const Flown flown{t, p, v, commands};
  const auto closed = loop_of(flown, loop);
  const auto open = answers(flown, loop, std::array{loop.attitude_lag}).front();
  loop.feedback_delay = 0;
  const auto early = loop_of(flown, loop);
  double simulated = 0, read = 0, answered = 0, undelayed = 0;
  for (std::size_t k = 0; k < t.size(); ++k) {
    simulated = std::max(simulated, (p[k] - predicted[k]).norm());
    read = std::max(read, (closed.p[k] - predicted[k]).norm());
    undelayed = std::max(undelayed, (early.p[k] - predicted[k]).norm());
    answered = std::max(answered, (open[k] - a[k]).norm());
  }
  EXPECT_LT(simulated, 0.001);
  EXPECT_LT(read, 0.005);
  EXPECT_GT(undelayed, 2 * read);
  EXPECT_LT(answered, 0.1);
}

}  // namespace
}  // namespace backwash::study

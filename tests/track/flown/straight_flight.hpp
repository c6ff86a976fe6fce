// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tests/track/flown/flown.hpp"

namespace backwash::track::test {

/// Along x at 1 m/s for five seconds, from the first command on.
inline AcceptedSegment at_1_mps() {
  std::vector<Setpoint> commands;
  for (int k = 0; k < 250; ++k) commands.push_back({{0.02 * k, 0, 1}, {1, 0, 0}, Vec3::Zero(), 0});
  return segment_of(std::move(commands));
}

/// A vehicle that follows set-points: its place is the last command's, in both frames, and its velocity comes to the
/// command's by 10 m/s².
class Flight {
 public:
  Flight() : tick_(vehicle(), 0.15) {
    for (int n = 0; n < 30; ++n) step();
    in.request = Request::enable;
    step();
    in.autopilot.offboard = in.autopilot.armed = true;
    step();
    EXPECT_EQ(out.supervisor.mode, Mode::tracking);
    segment.epoch = tick_.epoch();
    in.segment = &segment;
    step();
    EXPECT_TRUE(out.accepted);
    for (int n = 0; n < 100; ++n) step();
  }
  const TickOutput& step() {
    in.now_ns += 20'000'000;
    if (!in.odometry) in.odometry = OdometrySample{};
    const Vec3 faster = out.command.v_W - in.odometry->state.v_W;
    in.odometry->state.v_W += std::min(1.0, 10 * kControlPeriod / std::max(1e-9, faster.norm())) * faster;
    // To the last bit no two samples of a flying vehicle are alike.
    in.odometry->state.p_W = out.command.p_W + Vec3(in.now_ns / 20'000'000 % 2 ? 1e-9 : 0, 0, 0);
    in.odometry->received_ns = in.odometry->stamp_ns = in.now_ns;
    in.autopilot.heartbeat_age = 0.1;
    if (tick_.mode() == Mode::passive) in.odometry->state = {{0, 0, 1}, Vec3::Zero()};
    in.autopilot.pose = AutopilotFacts::Pose{in.now_ns, in.odometry->state, {1, 0, 0, 0}, in.now_ns};
    out = tick_.step(in);
    in.request = Request::none;
    in.segment = nullptr;
    return out;
  }
  AcceptedSegment segment = at_1_mps();
  TickInput in;
  TickOutput out;
  const Tracker& tracker() const { return tick_.tracker(); }
  const Epoch& epoch() const { return tick_.epoch(); }

 private:
  FlightTick tick_;
};

}  // namespace backwash::track::test

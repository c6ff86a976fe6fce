// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "core/plan/stop.hpp"
#include "core/track/flight_tick.hpp"

namespace backwash::track::test {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

inline Vehicle vehicle() {
  Vehicle v;
  v.limits = {1.5, 2};
  v.estimation = {0.02};
  v.initial_error = {0.1, 0.5};
  return v;
}

inline reach::ReachTube tube_of(const std::vector<Setpoint>& commands) {
  reach::ReachTube tube(commands.size() + 1);
  for (std::size_t k = 0; k < tube.size(); ++k) {
    tube[k].center.p_W = commands[std::min(k, commands.size() - 1)].p_W;
    tube[k].half_widths.fill(0.2);
    tube[k].half_widths_interval.fill(0.2);
  }
  return tube;
}

/// Half widths of 0.2 m around these commands; a verified stop every ten of them.
inline AcceptedSegment segment_of(std::vector<Setpoint> commands) {
  AcceptedSegment s;
  s.id = 1;
  s.commands = std::move(commands);
  s.tube = tube_of(s.commands);
  for (std::size_t branch = 0; branch < s.commands.size(); branch += 10) {
    const auto stopped = plan::stop_along(s.commands, branch, 4);
    const auto tube = tube_of(stopped);
    const auto from = static_cast<std::ptrdiff_t>(branch);
    s.stops.push_back({branch, {stopped.begin() + from, stopped.end()}, {tube.begin() + from, tube.end()}});
  }
  return s;
}

/// Along x for eight seconds, after half a second at 1 m/s.
inline AcceptedSegment straight() {
  std::vector<Setpoint> commands;
  for (int k = 0; k < 400; ++k) {
    const double t = kControlPeriod * k, x = t < 0.5 ? t * t : t - 0.25;
    commands.push_back({{x, 0, 1}, {std::min(1.0, 2 * t), 0, 0}, Vec3::Zero(), 0});
  }
  return segment_of(std::move(commands));
}

/// Two seconds into the flight unless told otherwise.
class Flown {
 public:
  enum class Until { aligned, tracking, flying };
  explicit Flown(Until until = Until::flying) {
    for (int n = 0; n < 30; ++n) step();
    if (until == Until::aligned) return;
    in.request = Request::enable;
    step();
    in.autopilot.offboard = in.autopilot.armed = true;
    step();
    EXPECT_EQ(out.supervisor.mode, Mode::tracking) << to_string(out.supervisor.reason);
    if (until == Until::tracking) return;
    offer(segment);
    EXPECT_TRUE(out.accepted);
    for (int n = 0; n < 100; ++n) step();
  }
  const TickOutput& offer(AcceptedSegment& offered) {
    offered.epoch = tick.epoch();
    in.segment = &offered;
    return step();
  }
  const TickOutput& step() {
    in.now_ns += 20'000'000;
    // Physically: where the last command was, in the controller's frame.
    if (started_) truth_L = {out.command_local.p_W, out.command_local.v_W};
    turned += 0.02 * yaw_rate;
    const auto turned_before = [&](std::int64_t ns) { return turned - 1e-9 * static_cast<double>(ns) * yaw_rate; };
    in.odometry.reset();
    if (vio_on) {
      OdometrySample s;
      s.received_ns = s.stamp_ns = in.now_ns - age_ns;
      s.state = frame_W.state(map_of(truth_L));
      s.state.p_W -= static_cast<double>(age_ns) * 1e-9 * s.state.v_W;
      if (shakes && in.now_ns / 20'000'000 % 2) s.state.p_W.x() += 1e-9;
      s.q = quaternion(frame_W.yaw + turned_before(age_ns));
      s.closures = closures;
      s.map_from_odom = frame_W;
      if (spoil) spoil(s);
      in.odometry = s;
    }
    in.autopilot.heartbeat_age = 0.1;
    State local = truth_L;
    local.p_W += local_off - static_cast<double>(pose_age_ns) * 1e-9 * local.v_W;
    const std::int64_t taken_ns = in.now_ns - pose_age_ns;
    in.autopilot.pose = AutopilotFacts::Pose{taken_ns, local, quaternion(kYaw + turned_before(pose_age_ns)),
                                             attitude_on ? taken_ns : attitude_at_ns, Vec3(0, 0, yaw_rate)};
    attitude_at_ns = in.autopilot.pose->attitude_at_ns;
    out = tick.step(in);
    started_ = tick.mode() != Mode::passive && tick.mode() != Mode::quiet;
    in.request = Request::none;
    in.segment = nullptr;
    return out;
  }
  /// Orders to disarm in so many ticks.
  int disarms(int ticks) {
    int asked = 0;
    for (int n = 0; n < ticks; ++n) asked += step().disarm;
    return asked;
  }
  static std::array<double, 4> quaternion(double yaw) { return {std::cos(yaw / 2), 0, 0, std::sin(yaw / 2)}; }
  /// Of a state in the controller's frame, before any loop closure.
  static State map_of(const State& local) { return RigidShift{kYaw, kT}.inverse().state(local); }

  static constexpr double kYaw = 0.4;
  inline static const Vec3 kT{3, -2, 0.5};
  FlightTick tick{vehicle(), 0.15};
  TickInput in;
  TickOutput out;
  AcceptedSegment segment = straight();
  State truth_L = RigidShift{kYaw, kT}.state(State{{0, 0, 1}, Vec3::Zero()});
  Vec3 local_off = Vec3::Zero();  ///< of the controller's estimate
  RigidShift frame_W;             ///< map ← odometry, of the newest loop closure
  std::uint32_t closures = 0;
  bool vio_on = true, attitude_on = true;
  bool shakes = true;  ///< to the last bit no two samples of a flying vehicle are alike
  std::int64_t attitude_at_ns = 0;
  std::int64_t age_ns = 0;          ///< of a sample when the tick sees it
  std::int64_t pose_age_ns = 0;     ///< the same of what the controller says
  double yaw_rate = 0, turned = 0;  ///< of the vehicle, rad/s; by it, rad
  std::function<void(OdometrySample&)> spoil;

 private:
  bool started_ = false;
};

/// The mode changes to a hold that freezes the set-point: no new positions, then LAND.
inline void expect_frozen_then_land(Flown& f, const Vec3& last) {
  ASSERT_EQ(f.out.supervisor.mode, Mode::hold) << to_string(f.out.supervisor.reason);
  for (int n = 0; f.out.supervisor.mode == Mode::hold && n < 30; ++n) {
    EXPECT_TRUE(f.out.supervisor.freeze);
    EXPECT_LT((f.out.command.p_W - last).norm(), 1e-9) << n;
    EXPECT_EQ(f.out.command.v_W, Vec3::Zero());
    EXPECT_FALSE(f.out.fresh) << "what comes after the fault is not believed";
    f.step();
  }
  EXPECT_EQ(f.out.supervisor.mode, Mode::land);
}

/// Enabled on the ground and not armed.
inline Flown on_the_ground() {
  Flown f(Flown::Until::aligned);
  f.in.autopilot.landed = true;
  f.in.request = Request::enable;
  f.step();
  f.in.autopilot.offboard = true;
  f.step();
  EXPECT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
  return f;
}

/// 0.6 m straight up from where the vehicle of on_the_ground() stands.
inline AcceptedSegment take_off() {
  AcceptedSegment s;
  s.id = 7;
  s.arms = true;
  const Vec3 here(0, 0, 1);
  for (int k = 0; k <= 75; ++k)
    s.commands.push_back({here + Vec3(0, 0, 0.008 * k), Vec3(0, 0, k < 75 ? 0.4 : 0), Vec3::Zero(), 0});
  s.tube.resize(s.commands.size() + 1);
  for (std::size_t k = 0; k < s.tube.size(); ++k) {
    s.tube[k].center.p_W = s.commands[std::min(k, s.commands.size() - 1)].p_W;
    s.tube[k].half_widths.fill(0.2);
    s.tube[k].half_widths_interval.fill(0.2);
  }
  return s;
}

}  // namespace backwash::track::test

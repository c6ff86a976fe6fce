// SPDX-License-Identifier: BSD-3-Clause
// What the tick makes of odometry, frames, loop closures and the autopilot's facts, with a vehicle that flies perfectly
// in a controller's frame that is turned and moved against the map.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "core/plan/stop.hpp"
#include "core/track/flight_tick.hpp"

namespace backwash::track {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Vehicle vehicle() {
  Vehicle v;
  v.limits = {1.5, 2};
  v.estimation = {0.02};
  v.initial_error = {0.1, 0.5};
  return v;
}

reach::ReachTube tube_of(const std::vector<Setpoint>& commands) {
  reach::ReachTube tube(commands.size() + 1);
  for (std::size_t k = 0; k < tube.size(); ++k) {
    tube[k].center.p_W = commands[std::min(k, commands.size() - 1)].p_W;
    tube[k].half_widths.fill(0.2), tube[k].half_widths_interval.fill(0.2);
  }
  return tube;
}

/// Along x for eight seconds, after half a second at 1 m/s, with a verified stop every ten commands.
AcceptedSegment straight() {
  AcceptedSegment s;
  s.id = 1;
  for (int k = 0; k < 400; ++k) {
    const double t = kControlPeriod * k, x = t < 0.5 ? t * t : t - 0.25;
    s.commands.push_back({{x, 0, 1}, {std::min(1.0, 2 * t), 0, 0}, Vec3::Zero(), 0});
  }
  s.tube = tube_of(s.commands);
  for (std::size_t branch = 0; branch < 400; branch += 10) {
    const auto stopped = plan::stop_along(s.commands, branch, 4);
    const auto tube = tube_of(stopped);
    const auto from = static_cast<std::ptrdiff_t>(branch);
    s.stops.push_back({branch, {stopped.begin() + from, stopped.end()}, {tube.begin() + from, tube.end()}});
  }
  return s;
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
    in.odometry.reset();
    if (vio_on) {
      OdometrySample s;
      s.received_ns = s.stamp_ns = in.now_ns - age_ns;
      s.state = frame_W.state(map_of(truth_L));
      s.state.p_W -= static_cast<double>(age_ns) * 1e-9 * s.state.v_W;
      s.q = quaternion(frame_W.yaw);
      s.closures = closures;
      s.map_from_odom = frame_W;
      if (spoil) spoil(s);
      in.odometry = s;
    }
    in.autopilot.heartbeat_age = 0.1;
    State local = truth_L;
    local.p_W += local_off;
    in.autopilot.pose =
        AutopilotFacts::Pose{in.now_ns, local, quaternion(kYaw), attitude_on ? in.now_ns : attitude_at_ns};
    attitude_at_ns = in.autopilot.pose->attitude_at_ns;
    out = tick.step(in);
    started_ = tick.mode() != Mode::passive && tick.mode() != Mode::quiet;
    in.request = Request::none;
    in.segment = nullptr;
    return out;
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
  std::int64_t attitude_at_ns = 0;
  std::int64_t age_ns = 0;  ///< of a sample when the tick sees it
  std::function<void(OdometrySample&)> spoil;

 private:
  bool started_ = false;
};

/// The mode changes to a hold that freezes the set-point: no new positions, then LAND.
void expect_frozen_then_land(Flown& f, const Vec3& last) {
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

TEST(TickReactions, AJumpFreezesAndGoodSamplesAfterItAreNotBelieved) {
  Flown f;
  const Vec3 last = f.out.command.p_W;
  f.spoil = [](auto& s) { s.state.p_W.y() += 0.5; };
  f.step();
  EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_jump);
  f.spoil = nullptr;  // as good as before
  expect_frozen_then_land(f, last);
}

TEST(TickReactions, OdometryThatStopsHoldsWithin100MillisecondsOfItsReception) {
  Flown f;
  f.vio_on = false;
  int ticks = 0;
  while (f.out.supervisor.mode == Mode::tracking && ticks < 20) f.step(), ++ticks;
  EXPECT_EQ(ticks, 5);
  EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_lost);
}

TEST(TickReactions, FourStampsThatDoNotRiseHoldAndThreeDoNot) {
  Flown f;
  const std::int64_t stamp = f.in.now_ns;
  f.spoil = [=](auto& s) { s.stamp_ns = stamp; };
  for (int n = 0; n < 3; ++n) EXPECT_EQ(f.step().supervisor.mode, Mode::tracking) << n;
  EXPECT_EQ(f.step().supervisor.mode, Mode::hold);
  EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_disorder);
}

TEST(TickReactions, TheErrorIsJudgedForATicksOwnSampleOnly) {
  Flown f;
  EXPECT_TRUE(f.step().inside.judged);
  f.vio_on = false;
  EXPECT_FALSE(f.step().inside.judged);
}

TEST(TickReactions, ALowBatteryLands) {
  Flown f;
  f.in.autopilot.battery = 0.16;
  EXPECT_EQ(f.step().supervisor.mode, Mode::tracking);
  f.in.autopilot.battery = 0.14;
  EXPECT_EQ(f.step().supervisor.mode, Mode::land);
}

TEST(TickReactions, TheAutopilotsOwnCountOfResetsIsEnough) {
  Flown f;
  f.in.autopilot.reset_counter = std::uint8_t{7};
  EXPECT_EQ(f.step().supervisor.mode, Mode::tracking);
  EXPECT_EQ(f.step().supervisor.mode, Mode::tracking);
  f.in.autopilot.reset_counter = std::uint8_t{8};
  EXPECT_EQ(f.step().supervisor.mode, Mode::hold);
  EXPECT_EQ(f.out.supervisor.reason, Reason::autopilot_reset);
}

TEST(TickReactions, FramesThatDriftApartHold) {
  Flown f;
  int ticks = 0;
  for (; f.out.supervisor.mode == Mode::tracking && ticks < 200; ++ticks) {
    f.local_off.y() += 0.001;
    f.step();
  }
  // 5 cm, and three times √2 estimation.position, for neither estimate says its error.
  EXPECT_EQ(f.out.supervisor.reason, Reason::frames_apart);
  EXPECT_TRUE(f.tick.tracker().braking()) << "on a verified stop: the pose is not at fault";
  EXPECT_GT(f.local_off.y(), 0.134);
  EXPECT_LT(f.local_off.y(), 0.134 + 0.02);
  for (; f.out.supervisor.reason == Reason::frames_apart && ticks < 600; ++ticks) {
    f.local_off.y() += 0.001;
    f.step();
  }
  EXPECT_EQ(f.out.supervisor.reason, Reason::frames_disagree) << "and twice as far, at last, it is";
  EXPECT_TRUE(f.out.supervisor.freeze);
  EXPECT_GT(f.local_off.y(), 0.269);
  EXPECT_LT(f.local_off.y(), 0.269 + 0.02);
}

TEST(TickReactions, HowFarFramesMayComeApartIsWhatBothEstimatesSayWithinLimits) {
  for (const auto& [sigma, limit] : {std::pair{0.001F, 0.10}, {0.03F, 0.14}, {0.5F, 0.25}}) {
    Flown f;
    f.in.position_sigma = sigma;
    for (int n = 0; f.out.supervisor.mode == Mode::tracking && n < 400; ++n) {
      f.local_off.y() += 0.001;
      f.step();
    }
    EXPECT_EQ(f.out.supervisor.reason, Reason::frames_apart);
    EXPECT_NEAR(f.local_off.y(), limit + 0.01, 0.01) << sigma;
  }
}

TEST(TickReactions, FramesThatCameApartAreFlownInAgainOnceTheyAreTogether) {
  Flown f(Flown::Until::tracking);
  for (int n = 0; f.out.supervisor.mode == Mode::tracking && n < 400; ++n) f.local_off.y() += 0.001, f.step();
  ASSERT_EQ(f.out.supervisor.reason, Reason::frames_apart);
  AcceptedSegment s = straight();
  s.tube.front().center = Flown::map_of(f.truth_L);
  f.offer(s);
  EXPECT_EQ(f.out.supervisor.mode, Mode::hold) << "still apart";
  f.local_off.setZero();
  for (int n = 0; n < 30; ++n) f.step();
  AcceptedSegment next = straight();
  next.id = 2;
  next.tube.front().center = Flown::map_of(f.truth_L);
  f.offer(next);
  EXPECT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
}

// At 1 m/s a sample of 15 ms ago lies 1.5 cm behind the controller's position of now.
TEST(TickReactions, TheOdometryIsComparedWithTheAutopilotAtOneMoment) {
  Flown f(Flown::Until::tracking);
  f.age_ns = 15'000'000;
  f.offer(f.segment);
  for (int n = 0; n < 100; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::tracking);
  EXPECT_LT(f.tick.alignment().position_residual(), 0.003);
}

TEST(TickReactions, WhileNothingIsCommandedAVioMayStartAnewElsewhere) {
  Flown f(Flown::Until::aligned);
  ASSERT_TRUE(f.out.fresh);
  f.spoil = [](auto& s) { s.state.p_W.x() += 5; };
  EXPECT_FALSE(f.step().fresh);
  EXPECT_TRUE(f.step().fresh);
}

TEST(TickReactions, ASetpointThatIsNoNumberIsNotSent) {
  for (const int part : {0, 1, 2, 3}) {
    Flown f(Flown::Until::tracking);
    for (auto& c : f.segment.commands) {
      if (part == 0) c.p_W.z() = kNan;
      if (part == 1) c.v_W.x() = kNan;
      if (part == 2) c.a_W.y() = kNan;
      if (part == 3) c.yaw = kNan;
    }
    f.offer(f.segment);
    ASSERT_TRUE(f.out.accepted);
    EXPECT_FALSE(f.out.finite) << part;
    EXPECT_FALSE(f.out.supervisor.send_setpoint) << part;
  }
}

/// A second loop closure in flight: everything of the map moves by D, and nothing physically.
TEST(TickReactions, ALoopClosureMovesMapAndFlightTogetherAndNothingPhysically) {
  const RigidShift first{0.1, {1, -1, 0.2}}, second{0.13, {1.3, -1.2, 0.25}};
  Flown f(Flown::Until::aligned);
  f.closures = 1, f.frame_W = first;
  for (int n = 0; n < 60; ++n) f.step();  // the frames are learnt anew
  f.in.request = Request::enable;
  f.step();
  f.in.autopilot.offboard = f.in.autopilot.armed = true;
  for (int n = 0; n < 100 && f.out.supervisor.mode != Mode::tracking; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
  for (auto& c : f.segment.commands) c = first.setpoint(c);
  for (auto& t : f.segment.tube) t.center = first.state(t.center);
  f.segment.closures = 1;
  f.offer(f.segment);
  ASSERT_TRUE(f.out.accepted);
  for (int n = 0; n < 100; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);

  const RigidShift D = second * first.inverse();
  const Setpoint map_before = f.out.command;
  Setpoint before = f.out.command_local;
  f.closures = 2, f.frame_W = second;
  for (int n = 0; n < 100; ++n) {
    f.step();
    ASSERT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason) << " " << n;
    EXPECT_TRUE(f.out.fresh);
    EXPECT_TRUE(f.out.inside.inside);
    EXPECT_NEAR((f.out.command_local.p_W - before.p_W).norm(), 0.02, 1e-6) << n;
    if (n == 0) {
      EXPECT_LT((f.out.command.p_W - D.point(map_before.p_W)).norm(), 0.0201);
      EXPECT_LT((f.out.command.v_W - D.rotate(map_before.v_W)).norm(), 1e-9);
    }
    before = f.out.command_local;
  }
  EXPECT_LT(f.tick.alignment().position_residual(), 0.002);
  AcceptedSegment old = f.segment;
  old.id = 2, old.continues = 1, old.branch = 350;
  EXPECT_TRUE(f.offer(old).refused) << "it is of the map before the closure";
  old.closures = 2;
  EXPECT_TRUE(f.offer(old).accepted);
}

// The same at rest: what is held moves with the map.
TEST(TickReactions, ALoopClosureMovesWhatIsHeld) {
  const RigidShift first{0.1, {1, -1, 0.2}}, second{0.13, {1.3, -1.2, 0.25}};
  Flown f(Flown::Until::aligned);
  f.closures = 1, f.frame_W = first;
  for (int n = 0; n < 60; ++n) f.step();
  f.in.request = Request::enable;
  f.step();
  f.in.autopilot.offboard = f.in.autopilot.armed = true;
  for (int n = 0; n < 100; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
  const Setpoint before = f.out.command, local = f.out.command_local;
  f.closures = 2, f.frame_W = second;
  f.step();
  EXPECT_LT((f.out.command.p_W - (second * first.inverse()).point(before.p_W)).norm(), 1e-9);
  EXPECT_LT((f.out.command_local.p_W - local.p_W).norm(), 1e-6);
  EXPECT_NEAR(wrap_angle(f.out.command_local.yaw - local.yaw), 0, 1e-6);
}

TEST(TickReactions, WhileTheFramesDisagreeTheyAreNotTakenAnew) {
  Flown f(Flown::Until::tracking);
  f.in.autopilot.reset_counter = std::uint8_t{1};
  for (int n = 0; f.out.supervisor.reason != Reason::frames_disagree && n < 400; ++n) {
    f.local_off.y() += 0.001;
    f.step();
  }
  ASSERT_EQ(f.out.supervisor.reason, Reason::frames_disagree);
  const Vec3 local = f.out.command_local.p_W;
  f.in.autopilot.reset_counter = std::uint8_t{2};
  f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::hold);
  EXPECT_LT((f.out.command_local.p_W - local).norm(), 1e-9);
}

/// A flight at rest in a map that has seen one loop closure already.
Flown after_a_closure(const RigidShift& first) {
  Flown f(Flown::Until::aligned);
  f.closures = 1, f.frame_W = first;
  for (int n = 0; n < 60; ++n) f.step();
  f.in.request = Request::enable;
  f.step();
  f.in.autopilot.offboard = f.in.autopilot.armed = true;
  for (int n = 0; n < 100; ++n) f.step();
  EXPECT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
  return f;
}

TEST(TickReactions, AnAbsurdLoopClosureIsHeldAndNothingIsFlownAfterIt) {
  const RigidShift first{0.1, {1, -1, 0.2}};
  for (const bool turn : {false, true}) {
    Flown f = after_a_closure(first);
    const Setpoint before = f.out.command, local = f.out.command_local;
    RigidShift D{turn ? 0.2 : 0.0, {turn ? 0.0 : 1.2, 0, 0}};
    if (turn) D.t = before.p_W - D.rotate(before.p_W);  // about the vehicle: it stays where it is
    f.closures = 2, f.frame_W = D * first;
    f.step();
    EXPECT_EQ(f.out.supervisor.mode, Mode::hold);
    EXPECT_EQ(f.out.supervisor.reason, Reason::closure_refused);
    for (int n = 0; n < 50; ++n) {
      f.step();
      EXPECT_LT((f.out.command.p_W - before.p_W).norm(), 1e-9);
      EXPECT_LT((f.out.command_local.p_W - local.p_W).norm(), 1e-9);
    }
    AcceptedSegment on = straight();
    for (auto& c : on.commands) c = first.setpoint(c);
    for (auto& t : on.tube) t.center = first.state(t.center);
    on.closures = 1;
    EXPECT_TRUE(f.offer(on).refused);
  }
}

// In one tick: a loop closure, and a hold that has no stop to rest on.
TEST(TickReactions, AHoldInTheTickOfALoopClosureIsWhereItPhysicallyWas) {
  const RigidShift first{0.1, {1, -1, 0.2}};
  Flown f = after_a_closure(first);
  const Setpoint local = f.out.command_local;
  f.closures = 2, f.frame_W = RigidShift{0.13, {1.3, -1.2, 0.25}};
  f.in.surroundings.outside = true;
  f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::hold);
  EXPECT_LT((f.out.command_local.p_W - local.p_W).norm(), 1e-6);
}

TEST(TickReactions, OdometryThatIsLateByItsOwnStampsIsAsOldAsThat) {
  Flown f(Flown::Until::tracking);
  int n = 0;
  f.spoil = [&](auto& s) { s.stamp_ns -= n * 1'000'000; };
  for (n = 1; n < 200 && f.out.supervisor.mode == Mode::tracking; ++n) f.step();
  EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_lost);
  EXPECT_NEAR(n, 81, 3);
}

// The controller follows the VIO, so that the frames agree: only the velocities contradict it.
TEST(TickReactions, PositionsThatGoAnotherWayThanTheirVelocitiesHold) {
  Flown f(Flown::Until::tracking);
  Vec3 drift = Vec3::Zero();
  f.spoil = [&](auto& s) { s.state.p_W += drift; };
  for (int n = 0; n < 100 && f.out.supervisor.mode == Mode::tracking; ++n) {
    drift.y() += 0.004;
    f.local_off = RigidShift{Flown::kYaw, Vec3::Zero()}.rotate(drift);
    f.step();
  }
  EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_inconsistent);
}

// Slow enough for the gate. Nothing says that the controller's own estimate was reset.
TEST(TickReactions, ATurningVioIsNotTakenForAResetOfTheController) {
  Flown f(Flown::Until::tracking);
  const Vec3 local = f.out.command_local.p_W;
  double yaw = 0;
  f.spoil = [&](auto& s) { s.q = Flown::quaternion(yaw); };
  for (int n = 0; n < 60; ++n) {
    yaw = std::min(yaw + 0.05, 1.0);
    f.step();
    EXPECT_NE(f.out.supervisor.reason, Reason::autopilot_reset);
    EXPECT_LT((f.out.command_local.p_W - local).norm(), 1e-9) << n;
  }
  EXPECT_NE(f.out.supervisor.mode, Mode::tracking);
}

// It claims a flight that the vehicle could fly; the controller's own estimate stands still and did not jump.
TEST(TickReactions, AVioThatFliesAwayIsNotTakenForAResetOfTheController) {
  Flown f(Flown::Until::tracking);
  const Vec3 local = f.out.command_local.p_W;
  double off = 0, v = 0;
  std::optional<Reason> held;
  f.spoil = [&](auto& s) { s.state.p_W.y() += off, s.state.v_W.y() += v; };
  for (int n = 0; f.out.supervisor.mode != Mode::land && n < 60; ++n) {
    const double before = v;
    v = std::min(v + 0.4, 1.4);
    off += kControlPeriod * (before + v) / 2;
    f.step();
    if (!held && f.out.supervisor.mode == Mode::hold) held = f.out.supervisor.reason;
    EXPECT_LT((f.out.command_local.p_W - local).norm(), 1e-9) << n;
  }
  EXPECT_EQ(held, Reason::frames_apart);
  EXPECT_EQ(f.out.supervisor.mode, Mode::land) << to_string(f.out.supervisor.reason);
}

TEST(TickReactions, AnAttitudeThatStopsArrivingHoldsAlsoWhileThePositionComes) {
  Flown f(Flown::Until::tracking);
  f.attitude_on = false;
  int ticks = 0;
  for (; f.out.supervisor.mode == Mode::tracking && ticks < 30; ++ticks) f.step();
  EXPECT_EQ(f.out.supervisor.reason, Reason::pose_silent);
  EXPECT_EQ(ticks, 15);
}

/// Enabled on the ground and not armed.
Flown on_the_ground() {
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
AcceptedSegment take_off() {
  AcceptedSegment s;
  s.id = 7;
  s.arms = true;
  const Vec3 here(0, 0, 1);
  for (int k = 0; k <= 75; ++k)
    s.commands.push_back({here + Vec3(0, 0, 0.008 * k), Vec3(0, 0, k < 75 ? 0.4 : 0), Vec3::Zero(), 0});
  s.tube.resize(s.commands.size() + 1);
  for (std::size_t k = 0; k < s.tube.size(); ++k) {
    s.tube[k].center.p_W = s.commands[std::min(k, s.commands.size() - 1)].p_W;
    s.tube[k].half_widths.fill(0.2), s.tube[k].half_widths_interval.fill(0.2);
  }
  return s;
}

TEST(TickReactions, NothingIsAcceptedWhileNobodyFollows) {
  Flown f(Flown::Until::aligned);
  AcceptedSegment s = take_off();
  EXPECT_TRUE(f.offer(s).refused);
  EXPECT_FALSE(f.out.arm);
}

TEST(TickReactions, ArmsForAnAcceptedTakeoffThatGoesOnAndForNothingElse) {
  AcceptedSegment good = take_off(), elsewhere = take_off();
  for (auto& t : elsewhere.tube) t.center.p_W.y() += 3;
  {
    Flown f = on_the_ground();
    EXPECT_TRUE(f.offer(good).arm);
  }
  {
    Flown f = on_the_ground();
    EXPECT_TRUE(f.offer(elsewhere).refused);
    EXPECT_FALSE(f.out.arm);
  }
  {
    Flown f = on_the_ground();
    f.in.surroundings.outside = true;  // a hold in the same tick
    EXPECT_TRUE(f.offer(good).accepted);
    ASSERT_EQ(f.out.supervisor.mode, Mode::hold);
    EXPECT_FALSE(f.out.arm);
  }
  {
    Flown f = on_the_ground();
    f.in.autopilot.armed = true;
    EXPECT_TRUE(f.offer(good).accepted);
    EXPECT_FALSE(f.out.arm) << "it is armed already";
  }
}

TEST(TickReactions, AVehicleThatWasAskedToArmCountsAsArmed) {
  Flown f = on_the_ground();
  AcceptedSegment s = take_off();
  ASSERT_TRUE(f.offer(s).arm);
  f.in.request = Request::disable;
  EXPECT_EQ(f.step().supervisor.mode, Mode::land) << "it may be in the air before it says so";
  for (int n = 0; n < 100; ++n) EXPECT_EQ(f.step().supervisor.mode, Mode::land) << "the autopilot may yet arm";
}

/// Orders to disarm in the three seconds after the tick of the STOP, of a vehicle that was armed for a take-off and
/// stopped on the ground.
int disarms(Flown& f, const std::function<void()>& then) {
  AcceptedSegment s = take_off();
  EXPECT_TRUE(f.offer(s).arm);
  f.in.autopilot.armed = true;
  f.step();
  f.in.request = Request::stop;
  f.step();
  then();
  int asked = 0;
  for (int n = 0; n < 160; ++n) asked += f.step().disarm;
  return asked;
}

TEST(TickReactions, AStopOnTheGroundStopsTheMotorsThereAndOnlyUntilTheNextTakeoff) {
  Flown f = on_the_ground();
  EXPECT_GE(disarms(f, [] {}), 2);
  Flown g = on_the_ground();
  EXPECT_EQ(disarms(g, [&] { g.in.autopilot.landed = false; }), 0) << "it is in the air";
  Flown h = on_the_ground();
  AcceptedSegment again = take_off();
  again.id = 2;
  h.in.autopilot.landed = true;
  EXPECT_EQ(disarms(h,
                    [&] {
                      h.in.autopilot.armed = false;
                      EXPECT_EQ(h.step().supervisor.mode, Mode::passive);
                      h.in.request = Request::enable;
                      h.step();
                      EXPECT_EQ(h.step().supervisor.mode, Mode::tracking);
                      const Vec3 moved = Flown::map_of(h.truth_L).p_W - again.tube.front().center.p_W;
                      for (auto& set : again.tube) set.center.p_W += moved;
                      for (auto& command : again.commands) command.p_W += moved;
                      EXPECT_TRUE(h.offer(again).arm);
                      h.in.autopilot.armed = true;
                    }),
            0);
}

/// A take-off of 0.6 m that was accepted and armed, from where the vehicle stands.
struct Lifting : Flown {
  Lifting() : Flown(on_the_ground()) {
    EXPECT_TRUE(offer(up).arm);
    EXPECT_EQ(out.supervisor.mode, Mode::lifting);
    in.autopilot.armed = true;
  }
  /// The vehicle is `height` above where it stood, whatever was commanded, and the autopilot says that it is in the
  /// air, or not, or nothing; on its way there it says that it takes off.
  const TickOutput& at(double height, std::optional<bool> in_air) { return at(Vec3(0, 0, height), in_air); }
  const TickOutput& at(const Vec3& above_W, std::optional<bool> in_air) {
    constexpr double kMost = 0.008;  // m a tick
    const Vec3 above = RigidShift{kYaw, Vec3::Zero()}.point(above_W);
    for (Vec3 way = above - off_L;; way = above - off_L) {
      const Vec3 step_L = way * std::min(1.0, kMost / std::max(1e-9, way.norm()));
      const bool arrives = way.norm() <= kMost;
      off_L += step_L;
      in.autopilot.landed = off_L.z() < 0.01;
      in.autopilot.in_air = arrives ? in_air : in_air ? std::optional(false) : std::nullopt;
      off_L.x() += in.now_ns / 20'000'000 % 2 ? 1e-9 : -1e-9;  // no two samples of a flight are alike to the last bit
      out.command_local.p_W = ground_L + off_L;
      out.command_local.v_W = step_L / kControlPeriod;
      step();
      if (arrives || out.supervisor.mode != Mode::lifting) return out;
    }
  }
  void settle(double height, std::optional<bool> in_air) {
    for (int n = 0; n < 51; ++n) at(height, in_air);
  }
  AcceptedSegment up = take_off();
  Vec3 ground_L = truth_L.p_W, off_L = Vec3::Zero();
};

// Issue: PX4 says IN_AIR 1.15 s before it leaves the ground; ArduPilot says it when the whole height is reached.
TEST(LiftOff, IsOverInTheAirAtItsHeightAndNotBeforeBothAreSo) {
  Lifting f;
  for (int n = 0; n < 100; ++n) EXPECT_EQ(f.at(0, true).supervisor.mode, Mode::lifting) << "on the ground";
  EXPECT_EQ(f.at(0.39, true).supervisor.mode, Mode::lifting) << "too low";
  for (int n = 0; n < 60; ++n) ASSERT_EQ(f.at(0.55, false).supervisor.mode, Mode::lifting) << "not by its own words";
  for (int n = 0; n < 50; ++n) ASSERT_EQ(f.at(0.55, true).supervisor.mode, Mode::lifting) << "not settled";
  EXPECT_EQ(f.at(0.55, true).supervisor.mode, Mode::tracking);
  EXPECT_EQ(f.out.supervisor.reason, Reason::lifted_off);
  EXPECT_EQ(f.out.command.p_W, f.up.commands.back().p_W) << "held where the take-off ends";
  EXPECT_EQ(f.out.released[0], &f.up) << "what comes next is a flight of its own, from the state in the air";
  Lifting silent;
  silent.settle(0.55, std::nullopt);
  EXPECT_EQ(silent.out.supervisor.mode, Mode::tracking) << "an autopilot that never says it";
}

TEST(LiftOff, RaisesTheSetpointOfAnAutopilotThatFollowsItOnTheGround) {
  Lifting f;
  double z = f.out.command.p_W.z();
  for (int n = 0; n < 80; ++n) {
    EXPECT_TRUE(f.at(0, false).supervisor.send_setpoint);
    EXPECT_FALSE(f.out.takeoff);
    EXPECT_GE(f.out.command.p_W.z(), z);
    z = f.out.command.p_W.z();
  }
  EXPECT_EQ(z, f.up.commands.back().p_W.z());
}

TEST(LiftOff, AsksAnAutopilotThatLiftsItselfOnceItIsArmedAndSendsItNoSetpointUntilItIsInTheAir) {
  Lifting f;
  f.in.autopilot.lifts_itself = true;
  f.in.autopilot.armed = false;
  for (int n = 0; n < 20; ++n) EXPECT_FALSE(f.at(0, false).takeoff) << "not armed yet";
  f.in.autopilot.armed = true;
  int asked = 0;
  for (int n = 0; n < 60; ++n) {
    asked += f.at(0, false).takeoff.has_value();
    EXPECT_FALSE(f.out.supervisor.send_setpoint);
    EXPECT_NEAR(f.out.takeoff.value_or(0.6), 0.6, 1e-9) << "m above where it stands";
  }
  EXPECT_GE(asked, 2) << "one command may be lost";
  EXPECT_LE(asked, 3);
  f.in.autopilot.takeoff_taken = true;
  for (int n = 0; n < 60; ++n) EXPECT_FALSE(f.at(0.3, false).takeoff) << "it has acknowledged it";
  f.settle(0.6, true);
  EXPECT_TRUE(f.out.supervisor.send_setpoint);
}

TEST(LiftOff, LandsWhateverEndsItBecauseNoHoldIsVerifiedSoLow) {
  const std::vector<std::function<void(Lifting&)>> ends{
      [](Lifting& f) { f.in.request = Request::stop; },
      [](Lifting& f) { f.in.request = Request::disable; },
      [](Lifting& f) { f.in.request = Request::land; },
      [](Lifting& f) { f.in.surroundings.tube_blocked = true; },
      [](Lifting& f) { f.in.surroundings.outside = true; },
      [](Lifting& f) { f.in.autopilot.battery = 0.01; },
      [](Lifting& f) { f.vio_on = false; },
      [](Lifting& f) { f.attitude_on = false; },
      [](Lifting& f) { f.spoil = [](OdometrySample& s) { s.state.p_W.x() += 3; }; },
  };
  for (std::size_t n = 0; n < ends.size(); ++n) {
    Lifting f;
    f.at(0.2, true);
    ends[n](f);
    int ticks = 0, asked = 0;
    for (; ticks < 30 && f.out.supervisor.mode == Mode::lifting; ++ticks) f.at(0.2, true);
    EXPECT_EQ(f.out.supervisor.mode, Mode::land) << n << ": " << to_string(f.out.supervisor.reason);
    EXPECT_LE(ticks, n < 7 && n != 6 ? 1 : 16) << n;
    for (int k = 0; k < 12; ++k) {
      asked += f.out.supervisor.request_land;
      f.at(0.2, true);
      EXPECT_FALSE(f.out.supervisor.send_setpoint);
      EXPECT_FALSE(f.out.disarm) << "in the air";
    }
    EXPECT_GE(asked, 1) << n;
  }
}

TEST(LiftOff, ThatStraysFromItsColumnLandsAfterThreeTicks) {
  Lifting f;
  f.at(0.3, true);
  EXPECT_EQ(f.at({0, 0.19, 0.3}, true).supervisor.mode, Mode::lifting) << "within its sets";
  for (int n = 0; n < 20; ++n) EXPECT_EQ(f.at({0, 0.19, 0.3}, true).supervisor.mode, Mode::lifting);
  int outside = 0;
  for (double y = 0.197; f.out.supervisor.mode == Mode::lifting && outside < 4; y += 0.007) {
    f.at({0, y, 0.3}, true);
    outside += y > 0.2;
  }
  EXPECT_EQ(f.out.supervisor.reason, Reason::outside_column);
  EXPECT_EQ(outside, 3);
}

TEST(LiftOff, ThatIsNotInTheAirAfterTwelveSecondsLandsAndIsDisarmedOnTheGround) {
  Lifting f;
  int ticks = 0, disarmed = 0;
  for (; f.out.supervisor.mode == Mode::lifting && ticks < 700; ++ticks) f.at(0, false);
  EXPECT_EQ(f.out.supervisor.reason, Reason::lift_timeout);
  EXPECT_NEAR(ticks, 600, 2);
  for (int n = 0; n < 100; ++n) disarmed += f.at(0, false).disarm;
  EXPECT_GE(disarmed, 2);
}

TEST(LiftOff, OfAVehicleThatDoesNotArmEndsAfterThreeSeconds) {
  Lifting f;
  f.in.autopilot.armed = false;
  int ticks = 0;
  for (; f.out.supervisor.mode == Mode::lifting && ticks < 700; ++ticks) f.at(0, false);
  EXPECT_EQ(f.out.supervisor.mode, Mode::passive);
  EXPECT_EQ(f.out.supervisor.reason, Reason::not_armed);
  EXPECT_NEAR(ticks, 150, 2);
}

TEST(LiftOff, IsNoLapseOfItsPlannerAndWhatEndsItIs) {
  Flown before = on_the_ground();
  Lifting f;
  EXPECT_EQ(f.tick.epoch(), before.tick.epoch());
  f.settle(0.6, true);
  ASSERT_EQ(f.out.supervisor.mode, Mode::tracking);
  EXPECT_EQ(f.tick.epoch(), before.tick.epoch());
  Lifting g;
  g.in.surroundings.tube_blocked = true;
  g.step();
  EXPECT_EQ(g.tick.epoch().lapse, before.tick.epoch().lapse + 1);
}

}  // namespace
}  // namespace backwash::track

// SPDX-License-Identifier: BSD-3-Clause
// Rows 41 and 42 of docs/faults.md in lockstep: a VIO whose frame turns, tilts or rescales, and an autopilot that falls
// silent. With an autopilot that keeps its own heading and with one that takes it from the VIO.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>

#include "core/sim/flight.hpp"
#include "tests/daemon/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

using track::Mode;
using track::Reason;

constexpr double kDegree = std::numbers::pi / 180;

/// What a wrong frame makes of a sample, about the place where the vehicle was when it went wrong.
struct Wrong {
  std::string name;
  std::function<Mat3(double t)> linear;  ///< of positions; t: s since it went wrong
  bool velocity = true;                  ///< the velocities are as wrong
  bool attitude = false;                 ///< and the attitude: linear is a rotation then
};

Wrong turned(double angle, const Vec3& axis, bool whole) {
  const Mat3 R = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  return {"", [R](double) { return R; }, whole, whole};
}

Wrong scaled(const Vec3& scale, bool whole) {
  const Mat3 S = scale.asDiagonal();
  return {"", [S](double) { return S; }, whole, false};
}

struct Course {
  int ticks_to_hold = -1;
  Reason reason = Reason::started;
  double off = 0;      ///< largest horizontal distance of the true vehicle from its route, m
  bool down = false;   ///< landed by itself
  bool moved = false;  ///< a set-point after the hold went elsewhere horizontally
};

double from_route(const std::vector<Setpoint>& route, const Vec3& p) {
  double least = 1e9;
  for (const Setpoint& c : route) least = std::min(least, (c.p_W - p).head<2>().norm());
  return least;
}

/// Flies at 1.4 m/s, spoils the frame, and follows what the vehicle really does for ten seconds.
Course fly_with(const Wrong& wrong, bool follows_yaw) {
  Lockstep rig;
  rig.autopilot->follows_yaw = follows_yaw;
  rig.take_off();
  rig.start_route(0.02);
  while (rig.view().command.v_W.norm() < 1.39 && rig.mode() == Mode::tracking) rig.tick();
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
  std::optional<OdometrySample> pivot;
  Vec3 integrated = Vec3::Zero();
  Mat3 before = Mat3::Identity();
  Vec3 true_before = Vec3::Zero();
  rig.spoil = [&](OdometrySample& s) {
    if (!pivot) pivot = s, integrated = true_before = s.state.p_W;
    const double t = static_cast<double>(s.stamp_ns - pivot->stamp_ns) * 1e-9;
    const Mat3 M = wrong.linear(t);
    // A frame that goes wrong by and by carries its positions on from where they are.
    integrated += 0.5 * (before + M) * (s.state.p_W - true_before);
    true_before = s.state.p_W;
    before = M;
    s.state.p_W = integrated;
    if (wrong.velocity) s.state.v_W = M * s.state.v_W;
    if (!wrong.attitude) return;
    const Eigen::Quaterniond q = Eigen::Quaterniond(M) * Eigen::Quaterniond(s.q[0], s.q[1], s.q[2], s.q[3]);
    s.q = {q.w(), q.x(), q.y(), q.z()};
  };
  Course course;
  std::optional<Vec3> held;
  for (int n = 0; n < 500; ++n) {
    rig.tick();
    course.off = std::max(course.off, from_route(rig.route(), rig.autopilot->truth().p_W));
    course.down = !rig.autopilot->armed();
    if (course.ticks_to_hold < 0 && rig.mode() != Mode::tracking)
      course.ticks_to_hold = n, course.reason = rig.reason();  // the first sample only sets the pivot
    if (rig.mode() != Mode::hold || rig.wire().setpoints.empty()) continue;
    const Vec3 p = rig.in_map(rig.wire().setpoints[0]).p_W;
    if (held && (p - *held).head<2>().norm() > 1e-3) course.moved = true;
    held = p;
  }
  return course;
}

void print(const std::string& what, bool follows_yaw, const Course& c) {
  std::printf("| %-34s | %-7s | %4d | %-43s | %5.2f |\n", what.c_str(), follows_yaw ? "follows" : "own",
              c.ticks_to_hold, to_string(c.reason), c.off);
}

std::string with(const char* what, double value) {
  char text[64];
  std::snprintf(text, sizeof text, what, value);
  return text;
}

/// Held on a pose that is not trusted, no new horizontal position, landed within `off` of the route.
void expect_safe(const std::string& what, const Wrong& wrong, int ticks, double off) {
  for (const bool follows_yaw : {false, true}) {
    const Course c = fly_with(wrong, follows_yaw);
    print(what, follows_yaw, c);
    EXPECT_GE(c.ticks_to_hold, 0) << what << " is flown to the end";
    EXPECT_LE(c.ticks_to_hold, ticks) << what;
    // One that leaves its set first stops on its verified way, and rests there: then nothing speaks against the pose.
    EXPECT_TRUE(!c.moved || c.reason == Reason::outside_set) << what;
    EXPECT_TRUE(c.down || c.reason == Reason::outside_set) << what;
    EXPECT_LT(c.off, off) << what;
  }
}

TEST(Row41, AFrameThatTurnsIsHeldAtOnceAndNotFlown) {
  for (const double angle : {10., 20., 45., 90., 135., 180., -10., -90.})
    expect_safe(with("turned by %.0f°", angle), turned(angle * kDegree, Vec3::UnitZ(), true), 2, 0.2);
}

TEST(Row41, AFrameThatTiltsIsHeld) {
  for (const double angle : {10., 20., 45., 90., 180.}) {
    const int ticks = angle < 20 ? 8 : 3;
    expect_safe(with("tilted by %.0f° about x", angle), turned(angle * kDegree, Vec3::UnitX(), true), ticks, 0.2);
    expect_safe(with("tilted by %.0f° about y", angle), turned(angle * kDegree, Vec3::UnitY(), true), ticks, 0.2);
  }
}

TEST(Row41, PositionsThatGoAnotherWayThanTheVelocitiesAreHeld) {
  for (const double angle : {10., 20., 45., 90., 180.})
    expect_safe(with("positions turned by %.0f°", angle), turned(angle * kDegree, Vec3::UnitZ(), false), 30, 0.3);
  for (const double scale : {0.5, 0.8, 0.9, 1.1, 1.25, 2.0})
    expect_safe(with("positions scaled by %.2f", scale), scaled(Vec3::Constant(scale), false), 60, 0.3);
  expect_safe("positions frozen along x", scaled({0, 1, 1}, false), 8, 0.3);
  expect_safe("positions mirrored along x", scaled({-1, 1, 1}, false), 5, 0.3);
}

TEST(Row41, PositionsAndVelocitiesThatAreRescaledTogetherAreHeldAtTheStepOfTheVelocity) {
  for (const double scale : {0.5, 0.65, 1.35, 2.0})
    expect_safe(with("all scaled by %.2f", scale), scaled(Vec3::Constant(scale), true), 2, 0.3);
  expect_safe("all frozen along x", scaled({0, 1, 1}, true), 2, 0.3);
  expect_safe("all mirrored along x", scaled({-1, 1, 1}, true), 2, 0.3);
}

TEST(Row41, AFrameThatTurnsByAndByDisagreesBeforeAWallIsReached) {
  for (const double rate : {2., 5., 10., 30., 90., -10.}) {
    const Wrong wrong{"",
                      [=](double t) { return Eigen::AngleAxisd(rate * t * kDegree, Vec3::UnitZ()).toRotationMatrix(); },
                      true, true};
    expect_safe(with("turning by %.0f°/s", rate), wrong, 200, 0.3);
  }
}

TEST(Row41, PositionsThatRescaleByAndByAreHeld) {
  for (const double rate : {-0.1, 0.1, -0.5, 0.5}) {
    const Wrong wrong{"", [=](double t) -> Mat3 { return std::max(0.2, 1 + rate * t) * Mat3::Identity(); }, false,
                      false};
    expect_safe(with("positions rescaling by %.1f/s", rate), wrong, 200, 0.3);
  }
}

TEST(Row42, WithoutTheAutopilotsPositionOrAttitudeItHoldsAfter300MillisecondsAndLandsAfterOneSecond) {
  for (const bool attitude : {false, true}) {
    InFlight rig;
    (attitude ? rig.autopilot->silent_attitude : rig.autopilot->silent_pose) = true;
    EXPECT_EQ(rig.ticks_until(Mode::hold, 50), 15);
    EXPECT_EQ(rig.reason(), Reason::pose_silent);
    EXPECT_EQ(rig.ticks_until(Mode::land, 50), 50 - 15);
    EXPECT_EQ(rig.reason(), Reason::pose_lost);
    EXPECT_TRUE(rig.wire().commanded(kCommandLand));
    for (int n = 0; n < 300; ++n) EXPECT_TRUE(rig.tick().setpoints.empty());
    EXPECT_FALSE(rig.autopilot->armed());
    EXPECT_LT(from_route(rig.route(), rig.autopilot->truth().p_W), 0.1);
  }
}

TEST(Row42, AShortSilenceIsBridgedAndAHoldAfterALongerOneTakesANewFlight) {
  InFlight rig(1);
  rig.autopilot->silent_pose = true;
  rig.ticks(14);
  rig.autopilot->silent_pose = false;
  rig.ticks(20);
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
  rig.autopilot->silent_pose = true;
  EXPECT_EQ(rig.ticks_until(Mode::hold, 50), 15);
  rig.ticks(5);
  rig.autopilot->silent_pose = false;
  rig.ticks(250);
  EXPECT_EQ(rig.mode(), Mode::hold);
  rig.offer(sim::hold_commands(rig.view().command.p_W, 1));
  rig.ticks(2);
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
}

TEST(Row42, EnableIsRefusedOnAnOldPose) {
  for (const bool attitude : {false, true}) {
    Lockstep rig;
    rig.ticks(60);
    (attitude ? rig.autopilot->silent_attitude : rig.autopilot->silent_pose) = true;
    rig.ticks(16);
    for (const int later : {0, 500}) {
      rig.ticks(later);
      rig.channels->orders.push({track::Request::enable});
      rig.ticks(2);
      EXPECT_EQ(rig.mode(), Mode::passive);
      EXPECT_EQ(rig.reason(), Reason::pose_silent);
    }
  }
}

// Row 43, from the other side: numbers of the autopilot that no vehicle has are as silence.
TEST(Row42, APoseOfTheAutopilotThatCannotBeIsAsNone) {
  for (const float far : {3e38F, -3e38F, 2e4F}) {
    InFlight rig;
    rig.autopilot->silent_pose = true;
    int ticks = 0;
    for (; rig.mode() == Mode::tracking && ticks < 50; ++ticks) {
      rig.say(mavlink::LocalPositionNed{.time_boot_ms = 1'000'000, .x = far});
      rig.tick();
    }
    EXPECT_EQ(rig.reason(), Reason::pose_silent);
    EXPECT_EQ(ticks, 15);
    EXPECT_GT(rig.link().telemetry().broken, 10u);
  }
}

/// A VIO as bad as the vehicle file allows (estimation.position, and its velocity by σ / 0.5 s), delivered with up to
/// 19 ms of delay and now and then not at all.
class RoughVio {
 public:
  RoughVio(Lockstep& rig, std::uint64_t seed) : rig_(rig), rng_(seed) {}
  void before_tick() {
    rig_.vio_age_steps = std::uniform_int_distribution(0, 19)(rng_);
    rig_.vio_on = std::uniform_real_distribution(0., 1.)(rng_) > 0.02;
  }
  void operator()(OdometrySample& s) {
    // The rig's own drift is 0.75 σ; this noise fills the rest at three standard deviations.
    const double sigma = vehicle_5in().estimation.position;
    for (int axis = 0; axis < 3; ++axis) {
      s.state.p_W[axis] += 0.25 / 3 / std::sqrt(3.) * sigma * normal_(rng_);
      s.state.v_W[axis] += sigma / 0.5 / 3 * normal_(rng_);
    }
    const Vec3 turn(normal_(rng_), normal_(rng_), normal_(rng_));
    const Eigen::Quaterniond noise(Eigen::AngleAxisd(0.3 * kDegree * turn.norm(), turn.normalized()));
    const Eigen::Quaterniond q = noise * Eigen::Quaterniond(s.q[0], s.q[1], s.q[2], s.q[3]);
    s.q = {q.w(), q.x(), q.y(), q.z()};
    // Taken up to its age before it is received.
    s.received_ns += std::uniform_int_distribution(0, rig_.vio_age_steps)(rng_) * 1'000'000;
  }

 private:
  Lockstep& rig_;
  std::mt19937_64 rng_;
  std::normal_distribution<double> normal_;
};

/// Back to `home` within 4 s, then figures of eight before it at up to 1.4 m/s and 1.9 m/s², the heading turning at up
/// to 1 rad/s.
std::vector<Setpoint> eights(const Setpoint& from, const Vec3& home, double seconds) {
  std::vector<Setpoint> commands;
  const Vec3 way = home - from.p_W;
  for (double t = 0; t < 4; t += kControlPeriod) {
    const double s = t / 4, v = 30 * s * s * (1 - s) * (1 - s) / 4, a = 60 * s * (1 - s) * (1 - 2 * s) / 16;
    commands.push_back({from.p_W + s * s * s * (10 - 15 * s + 6 * s * s) * way, v * way, a * way, from.yaw});
  }
  for (double t = 0; t < seconds; t += kControlPeriod) {
    const auto swing = [t](double amplitude, double omega) {  // from rest
      const double s = std::sin(omega * t), c = std::cos(omega * t);
      return std::array{amplitude * (1 - c), amplitude * omega * s, amplitude * omega * omega * c};
    };
    const auto x = swing(1.1, 1.25), y = swing(0.15, 2.5), z = swing(0.2, 0.7), yaw = swing(1.2, 0.8);
    commands.push_back({home + Vec3(x[0], y[0], z[0]), {x[1], y[1], z[1]}, {x[2], y[2], z[2]}, from.yaw + yaw[0]});
  }
  return commands;
}

// More than 20 minutes: eleven flights, each with five stops out of full motion, which tilt the vehicle at up to 13
// rad/s.
TEST(PoseFaults, RoughFlightsOnANoisyVioAreNeverHeld) {
  long ticks = 0, holds = 0;
  double worst_drift = 0;
  for (std::uint64_t seed = 1; seed <= 11; ++seed) {
    Lockstep rig;
    rig.recorded = false;
    rig.autopilot->follows_yaw = seed % 2 == 0;
    rig.take_off();
    const Vec3 home = rig.view().command.p_W;
    RoughVio vio(rig, seed);
    for (int leg = 0; leg < 5; ++leg) {
      rig.spoil = nullptr, rig.vio_on = true, rig.vio_age_steps = 0;
      rig.ticks(100);
      rig.offer(eights(rig.view().command, home, 18), false);
      rig.tick();
      ASSERT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
      rig.spoil = std::ref(vio);
      for (int n = 0; n < 1050; ++n, ++ticks) {
        vio.before_tick();
        rig.tick();
        if (rig.mode() != Mode::tracking) ++holds;
        ASSERT_EQ(rig.mode(), Mode::tracking)
            << to_string(rig.reason()) << ", seed " << seed << ", leg " << leg << ", tick " << n;
        worst_drift = std::max(worst_drift, rig.view().residual_rad);
      }
      rig.channels->orders.push({track::Request::stop});
      for (int n = 0; n < 100; ++n, ++ticks) {
        vio.before_tick();
        rig.tick();
        ASSERT_EQ(rig.mode(), Mode::hold);
        ASSERT_EQ(rig.reason(), Reason::stop_requested) << to_string(rig.reason()) << ", seed " << seed;
      }
    }
  }
  std::printf("%ld ticks (%.1f min), %ld false holds, largest yaw residual %.2f°\n", ticks,
              static_cast<double>(ticks) / 3000, holds, worst_drift / kDegree);
  EXPECT_GE(ticks, 20 * 60 * 50);
}

}  // namespace
}  // namespace backwash::daemon::test

// SPDX-License-Identifier: BSD-3-Clause
// Rows 2 and 43 of docs/faults.md in lockstep: every number of every message that comes in, as NaN, as infinite, and as
// a finite double that no float holds. The rig looks at every float of every message that goes out, at each tick.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "services/backwashd/in/localization.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
constexpr double kBad[] = {kNan, kInf, -kInf, 1e39, -1e39, 1e300};

/// A rig whose odometry comes by way of the DDS reader's front door. From `from` on, `spoil` changes each message.
class NumberFaults : public testing::Test {
 protected:
  struct Rig : Lockstep {
    Localization front{config::Daemon{}, vehicle_5in().estimation.position};
    std::function<void(dds::Odometry&)> message;
    bool from_odom = false;

    Rig() : Lockstep({0.7, Vec3(5, -3, 0.2)}, Medium::udp) {
      reader = [this](const OdometrySample& s) { return read(s); };
    }
    std::optional<OdometrySample> read(const OdometrySample& s) {
      static const std::string map = "map", odom = "odom", body = "base_link";
      const Eigen::Quaterniond q(s.q[0], s.q[1], s.q[2], s.q[3]);
      const Vec3 v_B = q.conjugate() * s.state.v_W;
      dds::Odometry m{};
      m.header.stamp = {static_cast<std::int32_t>(s.stamp_ns / 1'000'000'000),
                        static_cast<std::uint32_t>(s.stamp_ns % 1'000'000'000)};
      m.header.frame_id = dds::c_string(from_odom ? odom : map);
      m.child_frame_id = dds::c_string(body);
      m.pose.pose.position = {s.state.p_W.x(), s.state.p_W.y(), s.state.p_W.z()};
      m.pose.pose.orientation = {q.x(), q.y(), q.z(), q.w()};
      m.twist.twist.linear = {v_B.x(), v_B.y(), v_B.z()};
      if (message) message(m);
      const auto taken = front.odometry(m, s.received_ns);
      return taken ? std::optional(*taken) : std::nullopt;
    }
  };

  static double& member(dds::Odometry& m, int n) {
    auto& p = m.pose.pose.position;
    auto& v = m.twist.twist.linear;
    auto& q = m.pose.pose.orientation;
    double* const members[] = {&p.x, &p.y, &p.z, &q.x, &q.y, &q.z, &q.w, &v.x, &v.y, &v.z};
    return *members[n];
  }
};

TEST_F(NumberFaults, EveryNumberOfTheOdometryIsHeldWithin100msLandedWithin400AndNeverSent) {
  for (int n = 0; n < 10; ++n) {
    Rig rig;
    rig.take_off();
    rig.start_route(2);
    int turn = 0;
    rig.message = [&](auto& m) { member(m, n) = kBad[static_cast<std::size_t>(turn++) % std::size(kBad)]; };
    EXPECT_LE(rig.ticks_until(Mode::hold, 10), 5) << "member " << n;
    EXPECT_EQ(rig.mode(), Mode::hold) << "member " << n;
    EXPECT_GT(rig.ticks_until(Mode::land, 15), 0) << "member " << n;
    EXPECT_GT(rig.ticks_until(Mode::quiet, 15), 0) << "member " << n;
    for (int k = 0; k < 10; ++k) EXPECT_EQ(rig.tick().bytes, 0u);
  }
}

TEST_F(NumberFaults, ASingleBadNumberOfTheOdometryIsFlownPast) {
  Rig rig;
  rig.take_off();
  rig.start_route(0.5);
  const std::uint64_t received = rig.view().shown.odometry_received - rig.view().shown.odometry_rejected;
  int bad = 0;
  for (int n = 0; n < 10; ++n)
    for (const double value : kBad) {
      rig.message = [&](auto& m) { member(m, n) = value; };
      rig.tick();
      rig.message = nullptr;
      rig.ticks(2);
      ++bad;
      ASSERT_EQ(rig.mode(), Mode::tracking) << "member " << n << " = " << value << ": " << to_string(rig.reason());
    }
  EXPECT_EQ(rig.view().shown.odometry_received - rig.view().shown.odometry_rejected,
            received + 2 * static_cast<unsigned>(bad));
}

// The autopilot's own messages: floats, so what is beyond a float cannot come, but the largest float can.
TEST_F(NumberFaults, EveryNumberOfTheAutopilotIsDroppedOrHeldAndNeverSent) {
  constexpr float kBadFloats[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                                  -std::numeric_limits<float>::infinity(), std::numeric_limits<float>::max(), 1e30F};
  const auto at = [](auto& values, int n) -> float& { return values[static_cast<std::size_t>(n)]; };
  for (const float bad : kBadFloats) {
    Rig rig;
    rig.take_off();
    rig.start_route(0.5);
    const Vec3 start = rig.in_map(rig.wire().setpoints.at(0)).p_W;
    const auto boot = [&] { return static_cast<std::uint32_t>(rig.now_ns() / 1'000'000 % 1'000'000'000); };
    for (int n = 0; n < 7; ++n) {
      std::array<float, 7> v{1, 0, 0, 0, 0, 0, 0};
      at(v, n) = bad;
      rig.say(mavlink::AttitudeQuaternion{boot(), v[0], v[1], v[2], v[3], v[4], v[5], v[6]});
      rig.tick();
      rig.say(mavlink::Attitude{boot(), v[1], v[2], v[3], v[4], v[5], v[6]});
      rig.tick();
      rig.say(mavlink::Odometry{.x = v[1], .y = v[2], .z = v[3], .q = {v[0], 0, 0, 0}, .vx = v[4]});
      rig.say(mavlink::ParamValue{.param_value = bad, .param_count = 1, .param_id = {'N', 'A', 'V'}, .param_type = 9});
      rig.tick();
    }
    for (int n = 0; n < 6; ++n) {
      std::array<float, 6> v{5, -3, 0, 0, 0, 0};
      at(v, n) = bad;
      rig.say(mavlink::LocalPositionNed{boot(), v[0], v[1], v[2], v[3], v[4], v[5]});
      rig.tick();
    }
    rig.ticks(50);
    // Whatever the daemon made of it: what it sends now is where the vehicle can be.
    for (const auto& s : rig.wire().setpoints) EXPECT_LT((rig.in_map(s).p_W - start).norm(), 5) << bad;
  }
}

TEST_F(NumberFaults, EveryNumberOfALoopClosureIsRefusedWholeOrWithinAFloat) {
  static const std::string map = "map", odom = "odom";
  Rig rig;
  dds::TransformStamped identity{};
  identity.header.frame_id = dds::c_string(map);
  identity.child_frame_id = dds::c_string(odom);
  identity.transform.rotation.w = 1;
  ASSERT_TRUE(rig.front.loop_closure(identity));
  rig.from_odom = true;
  rig.take_off();
  rig.start_route(0.5);
  for (int n = 0; n < 7; ++n)
    for (const double value : {kNan, kInf, -kInf}) {
      dds::TransformStamped m = identity;
      auto& t = m.transform.translation;
      auto& q = m.transform.rotation;
      *std::array{&t.x, &t.y, &t.z, &q.x, &q.y, &q.z, &q.w}[static_cast<std::size_t>(n)] = value;
      EXPECT_FALSE(rig.front.loop_closure(m)) << n;
      rig.tick();
      EXPECT_EQ(rig.mode(), Mode::tracking);
    }
  // What a float does not hold, and what leaves no digits for the flight: refused or held, and in place all the same.
  Vec3 before = rig.in_map(rig.wire().setpoints.at(0)).p_W;
  for (const double value : {1e15, -1e15, 1e39, -1e39}) {
    dds::TransformStamped m = identity;
    m.transform.translation.y = value;
    (void)rig.front.loop_closure(m);
    for (int n = 0; n < 30; ++n) {
      for (const auto& s : rig.tick().setpoints) {
        EXPECT_LT((rig.in_map(s).p_W - before).norm(), 0.06) << value;
        before = rig.in_map(s).p_W;
      }
    }
  }
}

}  // namespace
}  // namespace backwash::daemon::test

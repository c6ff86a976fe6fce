// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/odometry_gate.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <vector>

namespace backwash::track {
namespace {

using Verdict = OdometryGate::Verdict;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kTick_ns = 20'000'000;

Vehicle vehicle() {
  Vehicle v;
  v.limits = {1.5, 2};
  v.estimation = {0.02};
  return v;
}

std::array<double, 4> wxyz(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

/// At 1 m/s along x, `tick` periods after the start.
OdometrySample at(int tick) {
  OdometrySample s;
  s.received_ns = s.stamp_ns = tick * kTick_ns;
  s.state = {{0.02 * tick, 0, 1}, {1, 0, 0}};
  return s;
}

/// Has taken good samples until tick 20.
OdometryGate running(const DriftLaw& law = {}) {
  OdometryGate gate(vehicle(), {}, law);
  for (int tick = 0; tick <= 20; ++tick) EXPECT_EQ(gate.take(at(tick), true), Verdict::good) << tick;
  return gate;
}

/// The verdict on the next sample, changed; only a good one becomes the last.
template <typename Change>
Verdict next(const Change& change, const DriftLaw& law = {}) {
  OdometryGate gate = running(law);
  OdometrySample s = at(21);
  change(s);
  const Verdict verdict = gate.take(s, true);
  EXPECT_EQ(gate.last()->stamp_ns, verdict == Verdict::good ? s.stamp_ns : at(20).stamp_ns);
  return verdict;
}

TEST(OdometryGate, RejectsWhatIsNoNumberOrNoRotation) {
  EXPECT_EQ(next([](auto&) {}), Verdict::good);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(next([i](auto& s) { s.state.p_W[i] = kNan; }), Verdict::rejected);
    EXPECT_EQ(next([i](auto& s) { s.state.v_W[i] = kNan; }), Verdict::rejected);
    EXPECT_EQ(next([i](auto& s) { s.state.p_W[i] = 1 / 0.0; }), Verdict::rejected);
  }
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(next([i](auto& s) { s.q[i] = kNan; }), Verdict::rejected);
  EXPECT_EQ(next([](auto& s) { s.q = {0, 0, 0, 0}; }), Verdict::rejected);
  EXPECT_EQ(next([](auto& s) { s.q = {1.02, 0, 0, 0}; }), Verdict::rejected);
  OdometryGate fresh(vehicle());
  OdometrySample broken = at(0);
  broken.state.p_W.x() = kNan;
  EXPECT_EQ(fresh.take(broken, false), Verdict::rejected);
  EXPECT_FALSE(fresh.last());
}

// v_max·dt + 3σ = 9 cm. What leaves the twist by 3.03 σ at once is none of them: 6.1 cm.
TEST(OdometryGate, TakesNoStepOfThePositionBeyondTheVehicles) {
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0, 0, 1)}) {
    const auto stepped = [&](double by, const DriftLaw& law) {
      return next([&](auto& s) { s.state.p_W += by * axis; }, law);
    };
    EXPECT_EQ(stepped(0.088, kDriftOverASecond), Verdict::good) << axis.transpose();
    EXPECT_EQ(stepped(0.092, kDriftOverASecond), Verdict::jump) << axis.transpose();
    EXPECT_EQ(stepped(0.059, {}), Verdict::good) << axis.transpose();
    EXPECT_EQ(stepped(0.088, {}), Verdict::inconsistent) << axis.transpose();
  }
}

// 15 m/s²·dt + 4 σ/0.5 s = 0.46 m/s.
TEST(OdometryGate, TakesNoStepOfTheVelocityBeyondTheVehicles) {
  EXPECT_EQ(next([](auto& s) { s.state.v_W.y() += 0.45; }), Verdict::good);
  EXPECT_EQ(next([](auto& s) { s.state.v_W.y() += 0.47; }), Verdict::jump);
}

// 3 rad/s·dt + 0.06 rad = 0.12 rad about the vertical; 15 rad/s·dt + 0.06 rad = 0.36 rad of tilt.
TEST(OdometryGate, TakesNoTurnAndNoTiltBeyondTheVehicles) {
  const auto turned = [](const Vec3& axis, double angle) {
    return next([=](auto& s) { s.q = wxyz(Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis))); });
  };
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_EQ(turned(Vec3::UnitZ(), sign * 0.115), Verdict::good);
    EXPECT_EQ(turned(Vec3::UnitZ(), sign * 0.125), Verdict::jump);
    EXPECT_EQ(turned(Vec3::UnitX(), sign * 0.35), Verdict::good);
    EXPECT_EQ(turned(Vec3::UnitX(), sign * 0.37), Verdict::jump);
    EXPECT_EQ(turned(Vec3::UnitY(), sign * 0.37), Verdict::jump);
  }
}

TEST(OdometryGate, BelievesNoVelocityBeyondAnyFlightOfOurs) {
  const auto first = [](double speed) {
    OdometrySample s = at(0);
    s.state.v_W = {0, 0, speed};
    return OdometryGate(vehicle()).take(s, false);
  };
  EXPECT_EQ(first(5.9), Verdict::good);
  EXPECT_EQ(first(6.1), Verdict::jump);
}

// Two millimetres a tick off what the velocity claims: too little for each step, 10 cm after a second or two.
TEST(OdometryGate, FindsPositionsThatGoAnotherWayThanTheVelocitiesClaim) {
  OdometryGate gate = running();
  int tick = 21;
  for (; tick < 200; ++tick) {
    OdometrySample s = at(tick);
    s.state.p_W.y() += 0.004 * (tick - 20);
    const Verdict verdict = gate.take(s, true);
    if (verdict == Verdict::good) continue;
    EXPECT_EQ(verdict, Verdict::inconsistent);
    break;
  }
  EXPECT_GT(tick, 40);
  EXPECT_LT(tick, 80);
  OdometryGate noisy = running();
  for (int n = 21; n < 200; ++n) {
    OdometrySample s = at(n);
    s.state.p_W.y() += 0.02 * (n % 2);
    EXPECT_EQ(noisy.take(s, true), Verdict::good) << n;
  }
}

TEST(OdometryGate, DropsStampsThatDoNotRise) {
  EXPECT_EQ(next([](auto& s) { s.stamp_ns = at(20).stamp_ns; }), Verdict::disorder);
  EXPECT_EQ(next([](auto& s) { s.stamp_ns = at(19).stamp_ns; }), Verdict::disorder);
}

TEST(OdometryGate, AClockThatIsSetIsNoDisorder) {
  for (const std::int64_t hours : {-1, 1}) {
    OdometryGate gate = running();
    for (int tick = 21; tick < 40; ++tick) {
      OdometrySample s = at(tick);
      s.stamp_ns += hours * 3'600'000'000'000;
      EXPECT_EQ(gate.take(s, true), Verdict::good) << tick;
    }
  }
}

// Stamps 0.4 s ahead of their reception would allow a step of 0.66 m.
TEST(OdometryGate, StampsAheadOfTheirReceptionWidenNothing) {
  EXPECT_EQ(next([](auto& s) {
              s.stamp_ns += 400'000'000;
              s.state.p_W.y() += 0.3;
            }),
            Verdict::jump);
}

TEST(OdometryGate, SaysHowLateASampleIsByItsOwnStamp) {
  OdometryGate gate = running();
  EXPECT_NEAR(gate.late(), 0, 1e-4);
  for (int n = 1; n <= 50; ++n) {  // each takes a millisecond longer than the last
    OdometrySample s = at(20 + n);
    s.stamp_ns -= n * 1'000'000;
    ASSERT_EQ(gate.take(s, true), Verdict::good) << n;
    EXPECT_NEAR(gate.late(), 0.001 * n, 2e-4);
  }
}

// A camera of 30 Hz on a clock of its own, for an hour before the flight.
TEST(OdometryGate, ClocksThatDifferBy100PpmMakeNoSampleLateWhateverTheRate) {
  for (const std::int64_t period_ns : {10'000'000, 33'333'333}) {
    OdometryGate gate(vehicle());
    double latest = 0;
    for (std::int64_t n = 0; n * period_ns < 3'600'000'000'000; ++n) {
      OdometrySample s = at(0);
      s.state.v_W.setZero();
      s.received_ns = n * period_ns;
      s.stamp_ns = s.received_ns - s.received_ns / 10'000;
      ASSERT_EQ(gate.take(s, false), Verdict::good) << n;
      latest = std::max(latest, gate.late());
    }
    EXPECT_LT(latest, 0.001) << period_ns;
  }
}

// Row 6: the fifth identical pose, the first counted, while the vehicle is commanded to move.
TEST(OdometryGate, FindsAPoseThatFreezesInMotionAndNotAtRest) {
  const auto verdicts = [](bool moving) {
    OdometryGate gate(vehicle());
    std::vector<Verdict> all;
    for (int tick = 0; tick < 7; ++tick) {
      OdometrySample s = at(tick);
      s.state = {{0, 0, 1}, Vec3::Zero()};
      all.push_back(gate.take(s, moving));
    }
    return all;
  };
  const auto in_motion = verdicts(true), at_rest = verdicts(false);
  for (std::size_t n = 0; n < 7; ++n) {
    EXPECT_EQ(in_motion[n], n < 4 ? Verdict::good : Verdict::frozen) << n;
    EXPECT_EQ(at_rest[n], Verdict::good) << n;
  }
}

// Positions that creep against their velocities are as far off after the map has turned.
TEST(OdometryGate, ALoopClosureTurnsWhatTheOdometryContradictsItselfBy) {
  const auto ticks = [](bool turned) {
    OdometryGate gate(vehicle());
    const RigidShift D = turned ? RigidShift{3, Vec3::Zero()} : RigidShift{};
    for (int n = 0; n < 100; ++n) {
      OdometrySample s = at(n);
      s.state = {{0.01 * n, 0, 1}, Vec3::Zero()};
      if (n == 5) gate.rebase(D);
      if (gate.take(n < 5 ? s : moved(D, s), true) == Verdict::inconsistent) return n;
    }
    return 100;
  };
  EXPECT_LT(ticks(false), 20);
  EXPECT_EQ(ticks(true), ticks(false));
}

TEST(OdometryGate, ALoopClosureMovesTheLastSampleWhole) {
  OdometryGate gate = running();
  const RigidShift D{0.5, {3, -2, 0.1}};
  gate.rebase(D);
  EXPECT_LT((gate.last()->state.p_W - D.point(at(20).state.p_W)).norm(), 1e-12);
  EXPECT_LT((gate.last()->state.v_W - D.rotate({1, 0, 0})).norm(), 1e-12);
  EXPECT_NEAR(heading(gate.last()->q), 0.5, 1e-12);
  OdometrySample s = at(21);
  s.state = D.state(s.state);
  s.q = wxyz(Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Vec3::UnitZ())));
  EXPECT_EQ(gate.take(s, true), Verdict::good);
}

}  // namespace
}  // namespace backwash::track

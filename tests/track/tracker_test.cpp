// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "core/track/tracker.hpp"
#include "tests/track/flown/first_set.hpp"

namespace backwash::track {
namespace {

/// n commands along x, entry k centred at (k, 0, 1) with half widths 0.1 + 0.01 k, until the next sample 0.5 wider.
AcceptedSegment segment(int n) {
  AcceptedSegment s;
  s.id = static_cast<std::uint64_t>(n);
  for (int k = 0; k < n; ++k)
    s.commands.push_back({.p_W = Vec3(k, 0, 1), .v_W = Vec3(1, 0, 0), .a_W = Vec3(0, 2, 0), .yaw = 0.1 * k});
  for (int k = 0; k <= n; ++k) {
    reach::TubeStep step{};
    step.t = k * kControlPeriod;
    step.center.p_W = Vec3(k, 0, 1);
    step.shape = Mat3::Zero();
    step.half_widths.fill(0.1 + 0.01 * k);
    step.half_widths_interval.fill(0.6 + 0.01 * k);
    s.tube.push_back(step);
  }
  return s;
}

/// Where the segments start.
const State kAtStart{Vec3(0, 0, 1), Vec3::Zero()};

Setpoint start() { return {.p_W = Vec3(-1, -2, 3), .v_W = Vec3(1, 1, 1), .a_W = Vec3(1, 1, 1), .yaw = 0.5}; }

void expect_rest(const Setpoint& s, const Vec3& p_W, double yaw) {
  EXPECT_EQ(s.p_W, p_W);
  EXPECT_EQ(s.v_W, Vec3::Zero());
  EXPECT_EQ(s.a_W, Vec3::Zero());
  EXPECT_EQ(s.yaw, yaw);
}

TEST(Tracker, HoldsAtRestBeforeTheFirstSegment) {
  Tracker tracker(start(), first_set());
  EXPECT_TRUE(tracker.finished());
  for (int i = 0; i < 3; ++i) expect_rest(tracker.step(), Vec3(-1, -2, 3), 0.5);
  EXPECT_TRUE(tracker.judge(Vec3(9, 9, 9)).inside);  // nothing was claimed
}

TEST(Tracker, GivesOneCommandATickThenHoldsTheLastAtRest) {
  Tracker tracker(start(), first_set());
  const auto s4 = segment(4);
  ASSERT_TRUE(tracker.accept(s4, kAtStart));
  for (int k = 0; k < 4; ++k) {
    EXPECT_FALSE(tracker.finished());
    const Setpoint s = tracker.step();
    EXPECT_EQ(s.p_W, Vec3(k, 0, 1));
    EXPECT_EQ(s.v_W, Vec3(1, 0, 0));
    EXPECT_EQ(s.a_W, Vec3(0, 2, 0));
  }
  EXPECT_TRUE(tracker.finished());
  for (int i = 0; i < 3; ++i) expect_rest(tracker.step(), Vec3(3, 0, 1), 0.1 * 3);
}

TEST(Tracker, JudgesAgainstTheSetOfTheTick) {
  Tracker tracker(start(), first_set());
  const auto s4 = segment(4);
  ASSERT_TRUE(tracker.accept(s4, kAtStart));
  for (int k = 0; k <= 4; ++k) {
    const double h = 0.1 + 0.01 * k;
    const Inside at = tracker.judge(Vec3(k + 0.9 * h, 0, 1));
    EXPECT_TRUE(at.inside);
    EXPECT_NEAR(at.error[kX], 0.9 * h, 1e-12);
    EXPECT_DOUBLE_EQ(at.half_widths[kX], h);
    EXPECT_FALSE(tracker.judge(Vec3(k + 1.1 * h, 0, 1)).inside);
    EXPECT_FALSE(tracker.judge(Vec3(k - 1.1 * h, 0, 1)).inside);
    tracker.step();
  }
}

// Errors leave the sets of a stated risk as it promises.
TEST(Tracker, JudgesByTheWorstCaseWhatWasPlannedByARisk) {
  auto s = segment(4);
  s.worst = 3;
  s.worst_at_rest = 2;
  Tracker tracker(start(), first_set());
  ASSERT_TRUE(tracker.accept(s, kAtStart));
  EXPECT_TRUE(tracker.judge(Vec3(0.29, 0, 1)).inside);
  EXPECT_FALSE(tracker.judge(Vec3(0.31, 0, 1)).inside);
  EXPECT_NEAR(tracker.judge(Vec3(0, 0, 1)).half_widths[kX], 0.3, 1e-12);
  const double widest = 3 * s.tube.back().half_widths_interval[kX];
  EXPECT_TRUE(tracker.within(Vec3(4 + widest - 0.01, 0, 1)));
  EXPECT_FALSE(tracker.within(Vec3(4 + widest + 0.01, 0, 1)));
  for (int k = 0; k < 5; ++k) tracker.step();
  EXPECT_NEAR(tracker.judge(Vec3(4, 0, 1)).half_widths[kX], 2 * s.tube.back().half_widths_interval[kX], 1e-12);
}

TEST(Tracker, HoldsTheIntervalOfTheLastSetPastTheEnd) {
  Tracker tracker(start(), first_set());
  const auto s4 = segment(4);
  ASSERT_TRUE(tracker.accept(s4, kAtStart));
  for (int i = 0; i < 5; ++i) tracker.step();
  for (int i = 0; i < 3; ++i) {
    EXPECT_DOUBLE_EQ(tracker.judge(Vec3(4, 0, 1)).half_widths[kX], 0.64);
    EXPECT_TRUE(tracker.judge(Vec3(4.63, 0, 1)).inside);
    EXPECT_FALSE(tracker.judge(Vec3(4.65, 0, 1)).inside);
    tracker.step();
  }
}

TEST(Tracker, EveryDirectionCanPutItOutside) {
  for (std::size_t d = 0; d < kDirections; ++d) {
    const Vec3 n = unit(static_cast<Direction>(d));
    auto s = segment(1);
    for (std::size_t other = 0; other < kDirections; ++other) s.tube[0].half_widths[other] = other == d ? 0.1 : 10;
    Tracker tracker(start(), first_set());
    ASSERT_TRUE(tracker.accept(s, kAtStart));
    for (const double side : {-1.0, 1.0}) {
      EXPECT_TRUE(tracker.judge(Vec3(0, 0, 1) + side * 0.099 * n).inside);
      EXPECT_FALSE(tracker.judge(Vec3(0, 0, 1) + side * 0.101 * n).inside);
      EXPECT_NEAR(tracker.judge(Vec3(0, 0, 1) + side * 0.101 * n).error[d], side * 0.101, 1e-12);
    }
  }
}

TEST(Tracker, AMeasurementThatIsNoNumberIsNotInside) {
  Tracker tracker(start(), first_set());
  const auto s1 = segment(1);
  ASSERT_TRUE(tracker.accept(s1, kAtStart));
  EXPECT_FALSE(tracker.judge(Vec3(0, 0, std::numeric_limits<double>::quiet_NaN())).inside);
}

TEST(Tracker, ANewSegmentTakesOverAtTheNextStep) {
  Tracker tracker(start(), first_set());
  const auto s4 = segment(4);
  ASSERT_TRUE(tracker.accept(s4, kAtStart));
  tracker.step();
  tracker.step();
  const auto s2 = segment(2);
  ASSERT_TRUE(tracker.accept(s2, kAtStart));
  EXPECT_EQ(tracker.step().p_W, Vec3(0, 0, 1));
  EXPECT_EQ(tracker.step().p_W, Vec3(1, 0, 1));
  EXPECT_TRUE(tracker.finished());
  expect_rest(tracker.step(), Vec3(1, 0, 1), 0.1);
}

TEST(Tracker, RefusesASegmentThatStartsElsewhereThanTheVehicleIs) {
  Tracker tracker(start(), first_set());
  const auto s = segment(4);
  const auto moved = [](double dx, double dv) { return State{Vec3(dx, 0, 1), Vec3(0, dv, 0)}; };
  // The ellipsoid of the first set: half axes 0.1 m and 0.5 m/s.
  EXPECT_FALSE(tracker.accept(s, moved(0.101, 0)));
  EXPECT_FALSE(tracker.accept(s, moved(0, 0.501)));
  EXPECT_FALSE(tracker.accept(s, moved(0.08, 0.4)));
  EXPECT_FALSE(tracker.accept(s, moved(std::numeric_limits<double>::quiet_NaN(), 0)));
  expect_rest(tracker.step(), Vec3(-1, -2, 3), 0.5);
  EXPECT_TRUE(tracker.accept(s, moved(0.06, 0.3)));
}

TEST(Tracker, AContinuedSegmentTakesOverWhereItBranchesAndNotLater) {
  auto next = segment(6);
  next.id = 9;
  next.continues = 4;
  next.branch = 2;
  next.commands[2].p_W.y() = 5;
  const auto s4 = segment(4);
  for (const int flown : {0, 1, 2, 3}) {
    Tracker tracker(start(), first_set());
    EXPECT_FALSE(tracker.accept(next, kAtStart));  // there is nothing to continue
    ASSERT_TRUE(tracker.accept(s4, kAtStart));
    for (int k = 0; k < flown; ++k) tracker.step();
    ASSERT_EQ(tracker.accept(next, State{}), flown <= 2);
    if (flown > 2) continue;
    for (int k = flown; k < 6; ++k) EXPECT_EQ(tracker.step().p_W, Vec3(k, k == 2 ? 5 : 0, 1));
  }
}

AcceptedSegment along_x(std::uint64_t id) {
  AcceptedSegment s;
  s.id = id;
  for (int k = 0; k < 200; ++k) s.commands.push_back({{0.02 * k, 0, 1}, {1, 0, 0}, Vec3::Zero(), 0});
  s.tube.resize(s.commands.size() + 1);
  for (std::size_t k = 0; k < s.tube.size(); ++k) {
    s.tube[k].center.p_W = s.commands[std::min(k, s.commands.size() - 1)].p_W;
    s.tube[k].half_widths = {0.3, 0.05, 0.3, 0.3, 0.3};
  }
  return s;
}

const State kStart{{0, 0, 1}, Vec3::Zero()};

TEST(TrackerLimits, ASegmentHasASetForEachCommandAndOneForItsEnd) {
  for (const int more : {-1, 1}) {
    AcceptedSegment s = along_x(1);
    s.tube.resize(s.tube.size() + static_cast<std::size_t>(more));
    EXPECT_FALSE(Tracker({}, first_set()).accept(s, kStart)) << more;
  }
  AcceptedSegment empty;
  empty.id = 1;
  empty.tube.resize(1);
  empty.tube[0].center = kStart;
  EXPECT_FALSE(Tracker({}, first_set()).accept(empty, kStart));
}

TEST(TrackerLimits, ASegmentContinuesTheOneThatIsFlownAndNoOther) {
  const AcceptedSegment flown = along_x(1);
  for (const std::uint64_t continued : {1u, 2u}) {
    Tracker tracker({}, first_set());
    ASSERT_TRUE(tracker.accept(flown, kStart));
    for (int n = 0; n < 20; ++n) tracker.step();
    AcceptedSegment on = along_x(3);
    on.continues = continued;
    on.branch = 40;
    EXPECT_EQ(tracker.accept(on, {}), continued == 1) << continued;
    EXPECT_EQ(tracker.index(), 20u);
  }
}

TEST(TrackerLimits, ASegmentOfAnotherMapFrameIsRefused) {
  AcceptedSegment s = along_x(1);
  Tracker tracker({}, first_set());
  tracker.rebase({}, 3);
  EXPECT_FALSE(tracker.accept(s, kStart));
  s.closures = 3;
  EXPECT_TRUE(tracker.accept(s, kStart));
}

TEST(TrackerLimits, TheClearanceIsThatOfTheSecondThatIsFlownNow) {
  AcceptedSegment s = along_x(1);
  s.clearance = 0.05;
  Tracker tracker({}, first_set());
  ASSERT_TRUE(tracker.accept(s, kStart));
  EXPECT_EQ(tracker.clearance(), 0.05) << "without more, the least of all";
  s.clearance_ahead = {0.1, 0.3, 0.9};
  for (std::size_t k = 0; k < 190; ++k, tracker.step())
    EXPECT_EQ(tracker.clearance(), s.clearance_ahead[std::min<std::size_t>(k / 50, 2)]) << k;
}

// A quarter turn of the map: what was an error along the wide x of the sets is one along the new y.
TEST(TrackerLimits, AfterALoopClosureTheErrorIsJudgedAlongTheSetsOwnDirections) {
  const AcceptedSegment s = along_x(1);
  Tracker tracker({}, first_set());
  ASSERT_TRUE(tracker.accept(s, kStart));
  const RigidShift D{std::numbers::pi / 2, {5, 6, 7}};
  tracker.rebase(D, 1);
  EXPECT_TRUE(tracker.judge(D.point({0.2, 0, 1})).inside);
  EXPECT_FALSE(tracker.judge(D.point({0, 0.1, 1})).inside);
  const Setpoint c = tracker.step();
  EXPECT_LT((c.p_W - D.point({0, 0, 1})).norm(), 1e-9);
  EXPECT_LT((c.v_W - Vec3(0, 1, 0)).norm(), 1e-9);
  tracker.rebase(D, 2);
  EXPECT_LT((tracker.step().p_W - (D * D).point({0.02, 0, 1})).norm(), 1e-9) << "one after the other";
  tracker.hold_at({{1, 2, 3}, {1, 0, 0}, Vec3::Zero(), 0.1});
  tracker.rebase(D, 3);
  EXPECT_LT((tracker.held().p_W - D.point({1, 2, 3})).norm(), 1e-9);
  EXPECT_EQ(tracker.held().v_W, Vec3::Zero());
}

// What is planned after a loop closure is in the map as it is now: it must not be moved by it once more.
TEST(TrackerLimits, ASegmentOfTheNewMapFrameIsFlownWhereItWasPlanned) {
  const AcceptedSegment before = along_x(1);
  Tracker tracker({}, first_set());
  ASSERT_TRUE(tracker.accept(before, kStart));
  const RigidShift D{0.5, {5, 6, 7}};
  tracker.rebase(D, 1);
  AcceptedSegment after = along_x(2);
  after.continues = 1;
  after.branch = 40;
  after.closures = 1;
  ASSERT_TRUE(tracker.accept(after, {}));
  const RigidShift left = tracker.shift();
  EXPECT_EQ(left.yaw, 0);
  EXPECT_TRUE(left.t.isZero(0));
  EXPECT_EQ(tracker.step().p_W, after.commands[0].p_W);
}

}  // namespace
}  // namespace backwash::track

// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <numbers>

#include "core/track/tracker.hpp"
#include "tests/track/flown/first_set.hpp"

namespace backwash::track {
namespace {

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

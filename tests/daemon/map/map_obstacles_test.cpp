// SPDX-License-Identifier: BSD-3-Clause
// What appears on the path (docs/faults.md row 14).
#include "tests/daemon/map/map_faults.hpp"

namespace backwash::daemon {
namespace {

TEST_F(ObstacleFault, AnObstacleOnThePathIsDecidedOnInOneTickAndTheVehicleRestsBeforeIt) {
  enable();
  fly();
  for (int n = 0; n < 150; ++n) tick();
  ASSERT_GT(out_.command.v_W.x(), 0.5);
  const Vec3 obstacle(in_map().x() + 1.2, 0, 1);
  voxel_at(obstacle);
  tick();
  EXPECT_EQ(out_.supervisor.mode, Mode::hold);
  EXPECT_EQ(out_.supervisor.reason, Reason::obstacle_ahead);
  double last = out_.command.p_W.x();
  for (int n = 0; n < 300; ++n) {
    tick();
    EXPECT_LE(std::abs(out_.command.p_W.x() - last), kVehicle.limits.v_max * kControlPeriod);
    last = out_.command.p_W.x();
    ASSERT_EQ(out_.supervisor.mode, Mode::hold) << to_string(out_.supervisor.reason);
    EXPECT_TRUE(out_.inside.inside);
  }
  EXPECT_EQ(out_.command.v_W, Vec3::Zero());
  const double gap = obstacle.x() - 0.1 - in_map().x() - kHalf - kVehicle.body.radius - kVehicle.estimation.position;
  EXPECT_GT(gap, 0);
}

TEST_F(ObstacleFault, WhatDoesNotReachIntoTheSetsIsFlownPast) {
  enable();
  fly();
  for (int n = 0; n < 100; ++n) tick();
  const double beside = 0.1 + kHalf + kVehicle.body.radius + kVehicle.estimation.position;
  voxel_at({in_map().x() + 1, beside + 1e-3, 1});
  EXPECT_EQ(ticks_until(Mode::hold, 5), 6);
  voxel_at({in_map().x() + 1, beside - 1e-3, 1});
  EXPECT_EQ(ticks_until(Mode::hold, 5), 1);
}

TEST_F(ObstacleFault, BehindTheVehicleNothingMatters) {
  enable();
  fly();
  for (int n = 0; n < 200; ++n) tick();
  voxel_at({in_map().x() - 0.5, 0, 1});
  EXPECT_EQ(ticks_until(Mode::hold, 5), 6);
}

TEST_F(ObstacleFault, WithoutAStopBeforeItTheVehicleHoldsAtOnce) {
  enable();
  fly(false);
  for (int n = 0; n < 150; ++n) tick();
  voxel_at({in_map().x() + 0.5, 0, 1});
  const Vec3 before = out_.command.p_W;
  tick();
  EXPECT_EQ(out_.supervisor.mode, Mode::hold);
  EXPECT_EQ(out_.command.p_W, before);
  EXPECT_EQ(out_.command.v_W, Vec3::Zero());
}

TEST_F(ObstacleFault, VoxelsThatCameBeforeTheSegmentAreHeldAgainstIt) {
  enable();
  voxel_at({in_map().x() + 2, 0, 1});
  for (int n = 0; n < 3; ++n) tick();
  fly();
  EXPECT_EQ(ticks_until(Mode::hold, 2), 1);
}

TEST_F(ObstacleFault, EverythingSeenWhileThePlanWasMadeIsHeldAgainstItAndNothingThatThePlanKnew) {
  for (const bool known : {false, true}) {
    SetUp();
    enable();
    voxel_at({in_map().x() + 2, 0, 1});
    seen_ns_ = known ? now_ns_ : now_ns_ - 1;
    for (int n = 0; n < 5; ++n) {  // and then much that does not matter
      tick();
      voxel_at({in_map().x() + 2, 1.5, 1});
    }
    for (int n = 0; n < 3; ++n) tick();
    fly();
    EXPECT_EQ(ticks_until(Mode::hold, 5) <= 3, !known);
    TearDown();
    flight_ = track::FlightTick{kVehicle, 0};
    odom_ = {-2, 0, 1};
  }
}

TEST_F(ObstacleFault, WhereMoreWasSeenThanIsKeptTheFlightCountsAsBlocked) {
  enable();
  for (int n = 0; n < 40; ++n) {
    voxel_at({in_map().x() + 2, 1.5, 1});
    tick();
  }
  fly();
  EXPECT_EQ(ticks_until(Mode::hold, 2), 1);
}

// Nobody knows where those were that found no room.
TEST_F(ObstacleFault, WhatARingHasNoRoomForIsHeldInTheTickAndWhatItHasRoomForWithinTwo) {
  for (auto* ring : {&channels_->scan_voxels, &channels_->map_voxels}) {
    for (const bool lost : {false, true}) {
      SetUp();
      enable();
      seen_ns_ = now_ns_;
      fly();
      for (int n = 0; n < 100; ++n) tick();
      NewVoxels beside{now_ns_, 0.2, 1, {{{in_map().x() + 2, 1.5, 1}}}};
      for (std::size_t n = 0; n < kVoxelRecords; ++n) ASSERT_TRUE(ring->push(beside));
      if (lost) {
        EXPECT_FALSE(ring->push(beside));
      }
      EXPECT_EQ(ticks_until(Mode::hold, 3), lost ? 1 : 4);
      beside.centers[0] = {in_map().x() + 0.8, 0, 1};
      for (std::size_t n = 1; !lost && n < kVoxelRecords; ++n) ASSERT_TRUE(ring->push({}));
      if (!lost) {
        ASSERT_TRUE(ring->push(beside));
        EXPECT_LE(ticks_until(Mode::hold, 3), 2);
      }
      flight_ = track::FlightTick{kVehicle, 0};
      odom_ = odom_before_ = {-2, 0, 1};
    }
  }
}

TEST_F(ObstacleFault, WhatWasLostIsHeldAgainstLaterFlightsUntilAWorldIsNewer) {
  while (channels_->scan_voxels.push({})) {
  }
  tick();
  const std::int64_t lost_ns = now_ns_;
  for (const bool newer : {false, true}) {
    flight_ = track::FlightTick{kVehicle, 0};
    odom_ = odom_before_ = {-2, 0, 1};
    enable();
    seen_ns_ = lost_ns - !newer;
    fly();
    EXPECT_EQ(ticks_until(Mode::hold, 10), newer ? 11 : 1);
  }
}

TEST_F(ObstacleFault, AFlightThatIsNotClearInTheNewestWorldIsBraked) {
  enable();
  fly();
  for (int n = 0; n < 100; ++n) tick();
  channels_->blocked_segment = 6;  // another one
  EXPECT_EQ(ticks_until(Mode::hold, 3), 4);
  channels_->blocked_segment = 7;
  EXPECT_EQ(ticks_until(Mode::hold, 3), 1);
  EXPECT_EQ(out_.supervisor.reason, Reason::obstacle_ahead);
  EXPECT_GT(out_.command.v_W.x(), 0) << "along the path, not at once";
}

}  // namespace
}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
// Faults of the map itself and of its frame (docs/faults.md rows 4, 9, 10 and 13).
#include "tests/daemon/map/map_faults.hpp"
#include "services/backwashd/channels.hpp"

namespace backwash::daemon {
namespace {

TEST_F(LateMapFault, ALateLiveMapIsHeldAfterASecondInMotionAndAStaticOneIsExempt) {
  for (const bool live : {false, true}) {
    settings_.live = live;
    settings_.closing_speed = 0.2;
    lookout_ = std::make_unique<Lookout>(*channels_, *channels_, kVehicle, settings_);
    if (!live) {
      enable();
      fly();
    } else {
      tick();
    }
    for (int n = 0; n < 20; ++n) tick();
    map_moves_on_ = false;
    const int ticks = ticks_until(Mode::hold, 60);
    if (live) {
      EXPECT_EQ(ticks, 51);
      EXPECT_EQ(out_.supervisor.reason, Reason::map_late);
    } else {
      EXPECT_EQ(ticks, 61);
      map_moves_on_ = true;
    }
  }
}

TEST_F(LateMapFault, TheAgeShrinksTheTrustedClearance) {
  settings_.live = true;
  settings_.closing_speed = 0.2;
  lookout_ = std::make_unique<Lookout>(*channels_, *channels_, kVehicle, settings_);
  enable();
  fly(true, 0.1);  // 0.1 m of clearance: 0.5 s at 0.2 m/s
  for (int n = 0; n < 20; ++n) tick();
  map_moves_on_ = false;
  EXPECT_EQ(ticks_until(Mode::hold, 60), 26);
}

// Past a narrow place what is ahead counts: 0.1 m for the first two seconds, 0.5 m from there on.
TEST_F(LateMapFault, TheClearanceOfWhatIsBehindDoesNotCount) {
  settings_.live = true;
  settings_.closing_speed = 0.2;
  lookout_ = std::make_unique<Lookout>(*channels_, *channels_, kVehicle, settings_);
  enable();
  fly(true, 0.1);
  segment_->clearance_ahead = {0.1, 0.1, 0.5, 0.5};
  for (int n = 0; n < 110; ++n) tick();
  map_moves_on_ = false;
  EXPECT_EQ(ticks_until(Mode::hold, 60), 51);  // 1 s: 0.5 m would last longer
}

TEST_F(LateMapFault, AtRestAnOldMapIsNoFault) {
  settings_.live = true;
  lookout_ = std::make_unique<Lookout>(*channels_, *channels_, kVehicle, settings_);
  enable();
  map_moves_on_ = false;
  EXPECT_EQ(ticks_until(Mode::hold, 100), 101);
}

TEST_F(LoopClosureFault, ALoopClosureMovesMapTrajectoryAndSetpointInOneTickAndTheVehicleNotAtAll) {
  closures_ = 1;  // where odom lies in the map before the flight
  map_from_odom_ = {0.1, {0.5, -0.3, 0}};
  enable();
  fly();
  for (int n = 0; n < 150; ++n) tick();
  const Setpoint before = out_.command;
  const Vec3 local_before = out_.command_local.p_W;
  const track::RigidShift newest = track::RigidShift{0.03, {0.2, 0.15, 0.05}} * map_from_odom_;
  const track::RigidShift D = newest * map_from_odom_.inverse();
  closures_ = 2;
  map_from_odom_ = newest;
  tick();
  // In the map everything moved by D (and on by one command); in the controller's frame only by that command.
  EXPECT_LT((out_.command.p_W - D.point(before.p_W)).norm(), kVehicle.limits.v_max * kControlPeriod);
  EXPECT_GT((out_.command.p_W - before.p_W).norm(), 0.1);
  EXPECT_LT((out_.command_local.p_W - local_before).norm(), kVehicle.limits.v_max * kControlPeriod);
  EXPECT_EQ(out_.supervisor.mode, Mode::tracking);
  EXPECT_TRUE(out_.inside.judged && out_.inside.inside);
  EXPECT_LT(flight_.alignment().position_residual(), 0.01);
  Vec3 last = out_.command_local.p_W;
  for (int n = 0; n < 100; ++n) {
    tick();
    ASSERT_EQ(out_.supervisor.mode, Mode::tracking);
    ASSERT_TRUE(out_.inside.inside);
    EXPECT_LT((out_.command_local.p_W - last).norm(), kVehicle.limits.v_max * kControlPeriod);
    last = out_.command_local.p_W;
  }
}

TEST_F(LoopClosureFault, ASegmentOfTheOldMapFrameIsRefused) {
  closures_ = 1;
  map_from_odom_ = {0, {0.5, 0, 0}};
  enable();
  fly();
  closures_ = 2;
  map_from_odom_ = {0, {0.6, 0, 0}};
  tick();
  auto old = *segment_;
  old.id = 8;
  old.continues = 7;
  old.branch = 300;
  tick(track::Request::none, &old);
  EXPECT_TRUE(out_.refused);
  old.closures = 2;
  tick(track::Request::none, &old);
  EXPECT_TRUE(out_.accepted);
}

TEST_F(LoopClosureFault, AfterAClosureNewVoxelsMeetTheTrajectoryWhereItNowIs) {
  closures_ = 1;
  map_from_odom_ = {0, {0, 0, 0}};
  enable();
  fly();
  for (int n = 0; n < 100; ++n) tick();
  closures_ = 2;
  map_from_odom_ = {0, {0, 0.9, 0}};
  tick();
  voxel_at({odom_.x() + 1, 0, 1});  // where the path was
  EXPECT_EQ(ticks_until(Mode::hold, 3), 4);
  voxel_at({odom_.x() + 1, 0.9, 1});  // where it is
  EXPECT_EQ(ticks_until(Mode::hold, 3), 1);
}

TEST_F(LoopClosureFault, AnAbsurdLoopClosureIsNotFlown) {
  const track::RigidShift absurd[] = {{0, {10, 0, 0}}, {1.57, {0, 0, 0}}, {0, {0, 1.05, 0}}, {0.18, {0, 0, 0}}};
  for (const track::RigidShift& shift : absurd) {
    closures_ = 1;
    map_from_odom_ = {0.1, {0.5, -0.3, 0}};
    flight_ = track::FlightTick(kVehicle, 0);
    odom_ = odom_before_ = {-2, 0, 1};
    enable();
    fly();
    for (int n = 0; n < 150; ++n) tick();
    const track::RigidShift flown = map_from_odom_;
    Setpoint last = out_.command_local;
    // About the vehicle, so that a turn alone moves it nowhere.
    map_from_odom_ = track::RigidShift{0, in_map()} * shift * track::RigidShift{0, -in_map()} * map_from_odom_;
    closures_ = 2;
    EXPECT_EQ(tick().supervisor.mode, Mode::hold);
    EXPECT_EQ(out_.supervisor.reason, Reason::closure_refused);
    EXPECT_EQ(flight_.tracker().closures(), 1u);
    for (int n = 0; n < 200; ++n) {
      EXPECT_LE((out_.command_local.p_W - last.p_W).norm(), kVehicle.limits.v_max * kControlPeriod);
      EXPECT_LT((flight_.odometry()->state.p_W - flown.point(odom_before_)).norm(), 1e-9)
          << "in the map that is flown in";
      EXPECT_EQ(out_.supervisor.mode, Mode::hold);
      last = out_.command_local;
      tick();
    }
    EXPECT_EQ(out_.command.v_W, Vec3::Zero());
    // Neither a segment of the map that is flown in nor one of the new map moves it.
    for (const std::uint32_t of : {1u, 2u}) {
      auto next = *segment_;
      next.id = 8 + of;
      next.closures = of;
      next.epoch = flight_.epoch();
      for (auto& set : next.tube) set.center.p_W += flight_.odometry()->state.p_W - segment_->tube.front().center.p_W;
      tick(track::Request::none, &next);
      EXPECT_TRUE(out_.refused) << of;
    }
    // In other hands it is where the closure says.
    offboard_ = false;
    tick();
    tick();
    offboard_ = true;
    EXPECT_EQ(out_.supervisor.mode, Mode::passive);
    EXPECT_EQ(flight_.tracker().closures(), 2u);
    EXPECT_LT((flight_.odometry()->state.p_W - in_map()).norm(), 1e-6);
  }
}

// What appears on the path (docs/faults.md row 14).

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

// SPDX-License-Identifier: BSD-3-Clause
// Faults of the map in lockstep (docs/faults.md rows 4, 9, 10, 13, 14): the control thread's decision and its lookout,
// with a vehicle that follows perfectly. Time is counted in ticks.
#include <gtest/gtest.h>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/stop.hpp"
#include "services/backwashd/lookout.hpp"

namespace backwash::daemon {
namespace {

using track::Mode;
using track::Reason;

constexpr std::int64_t kTick_ns = 20'000'000;
constexpr double kHalf = 0.05;  // half width of every set, m
const Vehicle kVehicle = config::load_vehicle("builtin:quad-5in").value();
const track::RigidShift kLocalFromOdom{0.5, {3, 4, 0.2}};

/// Sets around commands that are followed one tick later.
reach::ReachTube tube_of(const std::vector<Setpoint>& commands, const Vec3& before) {
  reach::ReachTube tube;
  for (std::size_t k = 0; k <= commands.size(); ++k) {
    reach::TubeStep set{};
    set.shape = Mat3::Zero();
    set.center.p_W = k == 0 ? before : commands[k - 1].p_W;
    set.half_widths.fill(kHalf);
    set.half_widths_interval.fill(kHalf);
    tube.push_back(set);
  }
  return tube;
}

class MapFaults : public testing::Test {
 protected:
  std::unique_ptr<Channels> channels_ = std::make_unique<Channels>();
  MapSettings settings_;
  std::unique_ptr<Lookout> lookout_;
  track::FlightTick flight_{kVehicle, 0};
  track::TickOutput out_;
  std::int64_t now_ns_ = 0;
  Vec3 odom_{-2, 0, 1}, odom_before_ = odom_;  // of the vehicle, in the VIO's frame; a tick before
  Vec3 velocity_ = Vec3::Zero();
  track::RigidShift map_from_odom_;
  std::uint32_t closures_ = 0;
  std::unique_ptr<track::AcceptedSegment> segment_;
  bool map_moves_on_ = true, offboard_ = true;
  std::int64_t seen_ns_ = 0;  // of the map that segments are verified in

  void SetUp() override {
    lookout_ = std::make_unique<Lookout>(*channels_, kVehicle, settings_);
    map::OccupancyGrid grid = map::builtin_scene("parallel-walls-4m", 0.2).value();
    channels_->worlds.offer({plan::build_world(std::move(grid), Model{}, kVehicle)});
  }
  Vec3 in_map() const { return map_from_odom_.point(odom_); }

  const track::TickOutput& tick(track::Request request = track::Request::none,
                                const track::AcceptedSegment* segment = nullptr) {
    now_ns_ += kTick_ns;
    if (map_moves_on_) channels_->map_ns = now_ns_;
    track::TickInput in;
    in.now_ns = now_ns_;
    in.request = request;
    in.segment = segment;
    in.odometry.emplace();
    in.odometry->received_ns = in.odometry->stamp_ns = now_ns_;
    // It is where it was told to be; its velocity comes to that by 10 m/s².
    const Vec3 faster = (odom_ - odom_before_) / kControlPeriod - velocity_;
    velocity_ += std::min(1.0, 10 * kControlPeriod / std::max(1e-9, faster.norm())) * faster;
    odom_before_ = odom_;
    in.odometry->state = {in_map(), map_from_odom_.rotate(velocity_)};
    in.odometry->q = {std::cos(map_from_odom_.yaw / 2), 0, 0, std::sin(map_from_odom_.yaw / 2)};
    in.odometry->closures = closures_;
    in.odometry->map_from_odom = map_from_odom_;
    in.autopilot.armed = true;
    in.autopilot.offboard = offboard_;
    in.autopilot.heartbeat_age = 0.1;
    in.autopilot.pose.emplace();
    in.autopilot.pose->at_ns = in.autopilot.pose->attitude_at_ns = now_ns_;
    in.autopilot.pose->state.p_W = kLocalFromOdom.point(odom_);
    in.autopilot.pose->q = {std::cos(kLocalFromOdom.yaw / 2), 0, 0, std::sin(kLocalFromOdom.yaw / 2)};
    in.surroundings = lookout_->look(flight_, now_ns_);
    out_ = flight_.step(in);
    if (out_.supervisor.send_setpoint) odom_ = kLocalFromOdom.inverse().point(out_.command_local.p_W);
    return out_;
  }
  void enable() {
    for (int n = 0; n < 40; ++n) tick();
    tick(track::Request::enable);
    for (int n = 0; n < 3; ++n) tick();
    ASSERT_EQ(out_.supervisor.mode, Mode::tracking);
  }
  /// 4 m along x, in 8 s, with stops every 0.2 s.
  void fly(bool with_stops = true, double clearance = 1) {
    constexpr int kSteps = 400;
    segment_ = std::make_unique<track::AcceptedSegment>();
    segment_->id = 7;
    segment_->closures = closures_;
    segment_->epoch = flight_.epoch();
    segment_->seen_ns = seen_ns_;
    segment_->clearance = clearance;
    const Vec3 from = in_map();
    for (int k = 0; k <= kSteps; ++k) {
      const double w = 2 * M_PI / kSteps, share = (k - std::sin(w * k) / w) / kSteps;
      const double v = 4 * (1 - std::cos(w * k)) / (kSteps * kControlPeriod);
      segment_->commands.push_back({from + Vec3(4 * share, 0, 0), {v, 0, 0}, Vec3::Zero(), 0});
    }
    segment_->tube = tube_of(segment_->commands, from);
    for (std::size_t branch = 0; with_stops && branch < kSteps; branch += 10) {
      const auto all = plan::stop_along(segment_->commands, branch, 2.0);
      plan::Stop stop{branch, {all.begin() + static_cast<long>(branch), all.end()}, {}};
      const auto tube = tube_of(all, from);
      stop.tube.assign(tube.begin() + static_cast<long>(branch), tube.end());
      segment_->stops.push_back(std::move(stop));
    }
    tick(track::Request::none, segment_.get());
    ASSERT_TRUE(out_.accepted);
  }
  void voxel_at(const Vec3& p) {
    NewVoxels voxels;
    voxels.received_ns = now_ns_;
    voxels.edge = 0.2;
    voxels.count = 1;
    voxels.centers[0] = {p.x(), p.y(), p.z()};
    channels_->scan_voxels.push(voxels);
  }
  int ticks_until(Mode mode, int most) {
    for (int n = 1; n <= most; ++n)
      if (tick().supervisor.mode == mode) return n;
    return most + 1;
  }
};

TEST_F(MapFaults, Row14AnObstacleOnThePathIsDecidedOnInOneTickAndTheVehicleRestsBeforeIt) {
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

TEST_F(MapFaults, Row14WhatDoesNotReachIntoTheSetsIsFlownPast) {
  enable();
  fly();
  for (int n = 0; n < 100; ++n) tick();
  const double beside = 0.1 + kHalf + kVehicle.body.radius + kVehicle.estimation.position;
  voxel_at({in_map().x() + 1, beside + 1e-3, 1});
  EXPECT_EQ(ticks_until(Mode::hold, 5), 6);
  voxel_at({in_map().x() + 1, beside - 1e-3, 1});
  EXPECT_EQ(ticks_until(Mode::hold, 5), 1);
}

TEST_F(MapFaults, Row14BehindTheVehicleNothingMatters) {
  enable();
  fly();
  for (int n = 0; n < 200; ++n) tick();
  voxel_at({in_map().x() - 0.5, 0, 1});
  EXPECT_EQ(ticks_until(Mode::hold, 5), 6);
}

TEST_F(MapFaults, Row14WithoutAStopBeforeItTheVehicleHoldsAtOnce) {
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

TEST_F(MapFaults, Row14VoxelsThatCameBeforeTheSegmentAreHeldAgainstIt) {
  enable();
  voxel_at({in_map().x() + 2, 0, 1});
  for (int n = 0; n < 3; ++n) tick();
  fly();
  EXPECT_EQ(ticks_until(Mode::hold, 2), 1);
}

TEST_F(MapFaults, Row14EverythingSeenWhileThePlanWasMadeIsHeldAgainstItAndNothingThatThePlanKnew) {
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

TEST_F(MapFaults, Row14WhereMoreWasSeenThanIsKeptTheFlightCountsAsBlocked) {
  enable();
  for (int n = 0; n < 40; ++n) {
    voxel_at({in_map().x() + 2, 1.5, 1});
    tick();
  }
  fly();
  EXPECT_EQ(ticks_until(Mode::hold, 2), 1);
}

TEST_F(MapFaults, Row14AFlightThatIsNotClearInTheNewestWorldIsBraked) {
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

TEST_F(MapFaults, Row9APoseOutsideTheMapIsHeld) {
  enable();
  tick();
  EXPECT_EQ(out_.supervisor.mode, Mode::tracking);
  // A map of another place comes.
  map::OccupancyGrid elsewhere({10, 10, 0}, 0.2, {5, 5, 5}, map::Cell::free);
  channels_->worlds.offer({plan::build_world(std::move(elsewhere), Model{}, kVehicle)});
  EXPECT_EQ(ticks_until(Mode::hold, 3), 1);
  EXPECT_EQ(out_.supervisor.reason, Reason::outside_map);
}

TEST_F(MapFaults, Row10WithoutAMapEnablingIsRefused) {
  channels_ = std::make_unique<Channels>();
  lookout_ = std::make_unique<Lookout>(*channels_, kVehicle, settings_);
  for (int n = 0; n < 40; ++n) tick();
  tick(track::Request::enable);
  EXPECT_EQ(out_.supervisor.mode, Mode::passive);
  EXPECT_EQ(out_.supervisor.reason, Reason::map_missing);
}

TEST_F(MapFaults, Row13ALateLiveMapIsHeldAfterASecondInMotionAndAStaticOneIsExempt) {
  for (const bool live : {false, true}) {
    settings_.live = live;
    settings_.closing_speed = 0.2;
    lookout_ = std::make_unique<Lookout>(*channels_, kVehicle, settings_);
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

TEST_F(MapFaults, Row13TheAgeShrinksTheTrustedClearance) {
  settings_.live = true;
  settings_.closing_speed = 0.2;
  lookout_ = std::make_unique<Lookout>(*channels_, kVehicle, settings_);
  enable();
  fly(true, 0.1);  // 0.1 m of clearance: 0.5 s at 0.2 m/s
  for (int n = 0; n < 20; ++n) tick();
  map_moves_on_ = false;
  EXPECT_EQ(ticks_until(Mode::hold, 60), 26);
}

// Past a narrow place what is ahead counts: 0.1 m for the first two seconds, 0.5 m from there on.
TEST_F(MapFaults, Row13TheClearanceOfWhatIsBehindDoesNotCount) {
  settings_.live = true;
  settings_.closing_speed = 0.2;
  lookout_ = std::make_unique<Lookout>(*channels_, kVehicle, settings_);
  enable();
  fly(true, 0.1);
  segment_->clearance_ahead = {0.1, 0.1, 0.5, 0.5};
  for (int n = 0; n < 110; ++n) tick();
  map_moves_on_ = false;
  EXPECT_EQ(ticks_until(Mode::hold, 60), 51);  // 1 s: 0.5 m would last longer
}

TEST_F(MapFaults, Row13AtRestAnOldMapIsNoFault) {
  settings_.live = true;
  lookout_ = std::make_unique<Lookout>(*channels_, kVehicle, settings_);
  enable();
  map_moves_on_ = false;
  EXPECT_EQ(ticks_until(Mode::hold, 100), 101);
}

TEST_F(MapFaults, Row4ALoopClosureMovesMapTrajectoryAndSetpointInOneTickAndTheVehicleNotAtAll) {
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

TEST_F(MapFaults, Row4ASegmentOfTheOldMapFrameIsRefused) {
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

TEST_F(MapFaults, Row4AfterAClosureNewVoxelsMeetTheTrajectoryWhereItNowIs) {
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

TEST_F(MapFaults, Row4AnAbsurdLoopClosureIsNotFlown) {
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

}  // namespace
}  // namespace backwash::daemon

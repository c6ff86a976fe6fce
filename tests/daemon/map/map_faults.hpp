// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/stop.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/plan/lookout.hpp"

/// Faults of the map in lockstep: the control thread's decision and its lookout, with a vehicle that follows perfectly.
/// Time is counted in ticks.
namespace backwash::daemon {

inline constexpr std::int64_t kTick_ns = 20'000'000;
inline constexpr double kHalf = 0.05;  // half width of every set, m
inline const Vehicle kVehicle = config::load_vehicle("builtin:quad-5in").value();
inline const track::RigidShift kLocalFromOdom{0.5, {3, 4, 0.2}};

/// Sets around commands that are followed one tick later.
inline reach::ReachTube tube_of(const std::vector<Setpoint>& commands, const Vec3& before) {
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
    lookout_ = std::make_unique<Lookout>(*channels_, *channels_, kVehicle, settings_);
    map::OccupancyGrid grid = map::builtin_scene("parallel-walls-4m", 0.2).value();
    channels_->worlds.offer({plan::build_world(std::move(grid), Model{}, kVehicle)});
  }
  Vec3 in_map() const { return map_from_odom_.point(odom_); }

  const track::TickOutput& tick(track::Request request = track::Request::none,
                                const track::AcceptedSegment* segment = nullptr) {
    now_ns_ += kTick_ns;
    if (map_moves_on_) channels_->map_ns.store(now_ns_);
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
    const Vec3 shakes(now_ns_ / kTick_ns % 2 ? 1e-10 : 0, 0, 0);  // to the last bit no two samples are alike
    in.odometry->state = {in_map() + shakes, map_from_odom_.rotate(velocity_)};
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
    EXPECT_TRUE(channels_->scan_voxels.push(voxels));
  }
  int ticks_until(Mode mode, int most) {
    for (int n = 1; n <= most; ++n)
      if (tick().supervisor.mode == mode) return n;
    return most + 1;
  }
};
using LateMapFault = MapFaults;
using LoopClosureFault = MapFaults;
using ObstacleFault = MapFaults;

}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/tick_log.hpp"

#include <algorithm>
#include <cstring>

namespace backwash::log {
namespace {

enum Flag : std::uint32_t {
  kOdometry = 1u << 0,
  kPortOpen = 1u << 2,
  kTransmitFailed = 1u << 3,
  kArmed = 1u << 4,
  kOffboard = 1u << 5,
  kPose = 1u << 6,
  kResetCounter = 1u << 7,
  kBattery = 1u << 8,
  kMapMissing = 1u << 9,
  kOutside = 1u << 10,
  kMapLate = 1u << 11,
  kTubeBlocked = 1u << 12,
  kStopBlocked = 1u << 13,
  kLandedKnown = 1u << 14,
  kLanded = 1u << 15,
  kInAirKnown = 1u << 16,
  kInAir = 1u << 17,
  kLiftsItself = 1u << 18,
  kTakeoffTaken = 1u << 19,
};

void put(const Vec3& from, double* to) noexcept { std::copy_n(from.data(), 3, to); }
Vec3 vec(const double* from) noexcept { return {from[0], from[1], from[2]}; }
std::uint32_t bit(bool set, std::uint32_t flag) noexcept { return set ? flag : 0; }

}  // namespace

TickInputRecord encode(const track::TickInput& in) noexcept {
  const auto& a = in.autopilot;
  const auto& s = in.surroundings;
  TickInputRecord r{};
  r.now_ns = in.now_ns;
  r.segment = in.segment ? in.segment->id : 0;
  r.missed_periods = in.missed_periods;
  r.request = static_cast<std::uint32_t>(in.request);
  r.order = in.order;
  r.heartbeat_age = a.heartbeat_age;
  r.reset_counter = a.reset_counter.value_or(0);
  r.battery = a.battery.value_or(0);
  r.position_sigma = in.position_sigma;
  r.flags = bit(in.odometry.has_value(), kOdometry) | bit(a.port_open, kPortOpen) |
            bit(a.transmit_failed, kTransmitFailed) | bit(a.armed, kArmed) | bit(a.offboard, kOffboard) |
            bit(a.pose.has_value(), kPose) | bit(a.reset_counter.has_value(), kResetCounter) |
            bit(a.battery.has_value(), kBattery) | bit(s.missing, kMapMissing) | bit(s.outside, kOutside) |
            bit(s.late, kMapLate) | bit(s.tube_blocked, kTubeBlocked) | bit(s.stop_blocked, kStopBlocked) |
            bit(a.landed.has_value(), kLandedKnown) | bit(a.landed.value_or(false), kLanded) |
            bit(a.in_air.has_value(), kInAirKnown) | bit(a.in_air.value_or(false), kInAir) |
            bit(a.lifts_itself, kLiftsItself) | bit(a.takeoff_taken, kTakeoffTaken);
  if (in.odometry) {
    r.odometry_received_ns = in.odometry->received_ns;
    r.odometry_stamp_ns = in.odometry->stamp_ns;
    put(in.odometry->state.p_W, r.p);
    put(in.odometry->state.v_W, r.v);
    std::ranges::copy(in.odometry->q, r.q);
    r.closures = in.odometry->closures;
    r.map_from_odom[0] = in.odometry->map_from_odom.yaw;
    put(in.odometry->map_from_odom.t, r.map_from_odom + 1);
  }
  if (a.pose) {
    r.pose_at_ns = a.pose->at_ns;
    r.attitude_at_ns = a.pose->attitude_at_ns;
    put(a.pose->omega_B, r.pose_omega);
    put(a.pose->state.p_W, r.pose_p);
    put(a.pose->state.v_W, r.pose_v);
    std::ranges::copy(a.pose->q, r.pose_q);
  }
  return r;
}

track::TickInput decode(const TickInputRecord& r, const track::AcceptedSegment* segment) noexcept {
  const auto has = [&](std::uint32_t flag) { return (r.flags & flag) != 0; };
  track::TickInput in;
  in.now_ns = r.now_ns;
  in.missed_periods = r.missed_periods;
  in.request = static_cast<track::Request>(r.request);
  in.order = r.order;
  in.segment = segment;
  in.position_sigma = r.position_sigma;
  in.autopilot.port_open = has(kPortOpen);
  in.autopilot.transmit_failed = has(kTransmitFailed);
  in.autopilot.armed = has(kArmed);
  in.autopilot.offboard = has(kOffboard);
  if (has(kLandedKnown)) in.autopilot.landed = has(kLanded);
  if (has(kInAirKnown)) in.autopilot.in_air = has(kInAir);
  in.autopilot.lifts_itself = has(kLiftsItself);
  in.autopilot.takeoff_taken = has(kTakeoffTaken);
  in.autopilot.heartbeat_age = r.heartbeat_age;
  if (has(kOdometry))
    in.odometry = {
        r.odometry_received_ns,           r.odometry_stamp_ns, {vec(r.p), vec(r.v)},
        {r.q[0], r.q[1], r.q[2], r.q[3]}, r.closures,          {r.map_from_odom[0], vec(r.map_from_odom + 1)}};
  if (has(kPose))
    in.autopilot.pose = {r.pose_at_ns,
                         {vec(r.pose_p), vec(r.pose_v)},
                         {r.pose_q[0], r.pose_q[1], r.pose_q[2], r.pose_q[3]},
                         r.attitude_at_ns,
                         vec(r.pose_omega)};
  if (has(kResetCounter)) in.autopilot.reset_counter = static_cast<std::uint8_t>(r.reset_counter);
  if (has(kBattery)) in.autopilot.battery = r.battery;
  in.surroundings = {has(kMapMissing), has(kOutside), has(kMapLate), has(kTubeBlocked), has(kStopBlocked)};
  return in;
}

void decided(const track::FlightTick& flight, const track::TickOutput& out, TickRecord& r) noexcept {
  r.segment = out.judged_segment;
  r.index = out.judged_index;
  r.mode = static_cast<std::uint32_t>(out.supervisor.mode);
  r.reason = static_cast<std::uint32_t>(out.supervisor.reason);
  r.judged = out.inside.judged;
  r.inside = out.inside.inside;
  r.frame_residual_m = static_cast<float>(flight.alignment().position_residual());
  r.frame_residual_rad = static_cast<float>(flight.alignment().yaw_residual());
  if (flight.odometry()) {
    put(flight.odometry()->state.p_W, r.p);
    put(flight.odometry()->state.v_W, r.v);
  }
  put(out.command.p_W, r.cmd_p);
  put(out.command.v_W, r.cmd_v);
  put(out.command.a_W, r.cmd_a);
  r.cmd_yaw = out.command.yaw;
  put(out.inside.center, r.center);
  std::ranges::copy(out.inside.half_widths, r.half_widths);
  put(out.command_local.p_W, r.local_p);
  put(out.command_local.v_W, r.local_v);
  put(out.command_local.a_W, r.local_a);
  r.local_yaw = out.command_local.yaw;
  const auto& s = out.supervisor;
  r.asked = bit(s.send_setpoint, kAskedSetpoint) | bit(s.send_heartbeat, kAskedHeartbeat) |
            bit(out.forward_odometry, kAskedOdometry) | bit(s.request_offboard, kAskedOffboard) |
            bit(s.request_land, kAskedLand) | bit(out.arm, kAskedArm) | bit(out.disarm, kAskedDisarm) |
            bit(out.takeoff.has_value(), kAskedTakeoff);
}

ConstantsRecord constants(const Vehicle& vehicle, double battery_land) noexcept {
  return {vehicle.limits.v_max, vehicle.estimation.position, vehicle.initial_error.position,
          vehicle.initial_error.velocity, battery_land};
}

}  // namespace backwash::log

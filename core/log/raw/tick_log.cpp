// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/raw/tick_log.hpp"

#include <algorithm>
#include <optional>

#include "core/log/raw/tick_decisions.hpp"

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
  kRougher = 1u << 20,
  kLineSlow = 1u << 21,
};

/// Members of a TickInput into its record.
struct ToRecord {
  TickInputRecord& record;

  template <class From, class To>
  void number(From from, To& to) const noexcept {
    to = static_cast<To>(from);
  }
  void above_zero(std::optional<float> from, float& to) const noexcept { to = from.value_or(0); }
  template <class Numbers>
  void numbers(const Numbers& from, double* to) const noexcept {
    std::copy_n(from.data(), from.size(), to);
  }
  void flag(bool set, std::uint32_t flag) const noexcept { record.flags |= set ? flag : 0; }
  template <class T, class Members>
  void optional(const std::optional<T>& from, std::uint32_t known, Members members) const noexcept {
    flag(from.has_value(), known);
    if (from) members(*from);
  }
};

/// The same from the record: what is optional is there if its flag is set.
struct FromRecord {
  const TickInputRecord& record;

  template <class To, class From>
  void number(To& to, From from) const noexcept {
    to = static_cast<To>(from);
  }
  void above_zero(std::optional<float>& to, float from) const noexcept {
    if (from > 0) to = from;
  }
  template <class Numbers>
  void numbers(Numbers& to, const double* from) const noexcept {
    std::copy_n(from, to.size(), to.data());
  }
  void flag(bool& to, std::uint32_t flag) const noexcept { to = (record.flags & flag) != 0; }
  template <class T, class Members>
  void optional(std::optional<T>& to, std::uint32_t known, Members members) const noexcept {
    bool there = false;
    flag(there, known);
    if (there) members(to.emplace(T{}));  // clang 14 takes no emplace() of a nested aggregate
  }
};

/// Every member of a TickInput but its segment, and its place in the record: the one list that both directions follow.
template <class Input, class Record, class Direction>
void each_member(Input& in, Record& r, const Direction& direction) noexcept {
  direction.number(in.now_ns, r.now_ns);
  direction.number(in.missed_periods, r.missed_periods);
  direction.number(in.request, r.request);
  direction.number(in.order, r.order);
  direction.above_zero(in.position_sigma, r.position_sigma);
  direction.optional(in.odometry, kOdometry, [&](auto& o) {
    direction.number(o.received_ns, r.odometry_received_ns);
    direction.number(o.stamp_ns, r.odometry_stamp_ns);
    direction.numbers(o.state.p_W, r.p);
    direction.numbers(o.state.v_W, r.v);
    direction.numbers(o.q, r.q);
    direction.number(o.closures, r.closures);
    direction.number(o.map_from_odom.yaw, r.map_from_odom[0]);
    direction.numbers(o.map_from_odom.t, r.map_from_odom + 1);
  });
  auto& a = in.autopilot;
  direction.flag(a.port_open, kPortOpen);
  direction.flag(a.transmit_failed, kTransmitFailed);
  direction.flag(a.line_slow, kLineSlow);
  direction.flag(a.armed, kArmed);
  direction.flag(a.offboard, kOffboard);
  direction.flag(a.lifts_itself, kLiftsItself);
  direction.flag(a.takeoff_taken, kTakeoffTaken);
  direction.optional(a.landed, kLandedKnown, [&](auto& landed) { direction.flag(landed, kLanded); });
  direction.optional(a.in_air, kInAirKnown, [&](auto& in_air) { direction.flag(in_air, kInAir); });
  direction.number(a.heartbeat_age, r.heartbeat_age);
  direction.optional(a.reset_counter, kResetCounter, [&](auto& n) { direction.number(n, r.reset_counter); });
  direction.optional(a.battery, kBattery, [&](auto& share) { direction.number(share, r.battery); });
  direction.optional(a.pose, kPose, [&](auto& pose) {
    direction.number(pose.at_ns, r.pose_at_ns);
    direction.number(pose.attitude_at_ns, r.attitude_at_ns);
    direction.numbers(pose.state.p_W, r.pose_p);
    direction.numbers(pose.state.v_W, r.pose_v);
    direction.numbers(pose.q, r.pose_q);
    direction.numbers(pose.omega_B, r.pose_omega);
  });
  auto& s = in.surroundings;
  direction.flag(s.missing, kMapMissing);
  direction.flag(s.outside, kOutside);
  direction.flag(s.late, kMapLate);
  direction.flag(s.tube_blocked, kTubeBlocked);
  direction.flag(s.stop_blocked, kStopBlocked);
  direction.flag(s.rougher, kRougher);
}

}  // namespace

StatedTickInputRecord encode(const track::TickInput& in) noexcept {
  StatedTickInputRecord r{};
  r.input.segment = in.segment ? in.segment->id : 0;
  each_member(in, r.input, ToRecord{r.input});
  if (in.odometry && in.odometry->velocity_variance)
    std::copy_n(in.odometry->velocity_variance->data(), 3, r.velocity_variance);
  return r;
}

track::TickInput decode(const TickInputRecord& r, const track::AcceptedSegment* segment) noexcept {
  track::TickInput in;
  in.segment = segment;
  each_member(in, r, FromRecord{r});
  return in;
}

void decided(const track::FlightTick& flight, const track::TickOutput& out, TickRecord& r) noexcept {
  each_decision(kDecisions, [&](const auto& decision) { decision.write(Decided{flight, out}, r); });
}

track::TickInput decode(const StatedTickInputRecord& r, const track::AcceptedSegment* segment) noexcept {
  track::TickInput in = decode(r.input, segment);
  const Vec3 said(r.velocity_variance[0], r.velocity_variance[1], r.velocity_variance[2]);
  if (in.odometry && !said.isZero(0)) in.odometry->velocity_variance = said;
  return in;
}

DriftConstantsRecord constants(const Vehicle& vehicle, double battery_land, const OdometryTiming& timing,
                               const track::DriftLaw& law) noexcept {
  return {{{vehicle.limits.v_max, vehicle.estimation.position, vehicle.initial_error.position,
            vehicle.initial_error.velocity, battery_land},
           timing.rate_least,
           timing.latency},
          law.ends,
          law.deviations,
          law.scale,
          law.lag,
          {law.over[0], law.over[1], law.over[2]}};
}

}  // namespace backwash::log

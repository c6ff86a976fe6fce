// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/control_loop.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace backwash::daemon {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint64_t kTicksPerSecond = 50;
constexpr std::uint32_t kLocalPositionNed = 32, kAttitudeQuaternion = 31, kExtendedSysState = 245;

firmware_bridge::Time time_of(std::int64_t ns) noexcept { return firmware_bridge::Time(std::chrono::nanoseconds(ns)); }

double yaw_of(const Eigen::Quaterniond& q) noexcept {
  return std::atan2(2 * (q.w() * q.z() + q.x() * q.y()), 1 - 2 * (q.y() * q.y() + q.z() * q.z()));
}

Eigen::Quaterniond attitude_of(const OdometrySample& s) noexcept { return {s.q[0], s.q[1], s.q[2], s.q[3]}; }

std::uint64_t page_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return static_cast<std::uint64_t>(usage.ru_minflt + usage.ru_majflt);
}

}  // namespace

ControlLoop::ControlLoop(Channels& channels, firmware_bridge::AutopilotLink& link, const Vehicle& vehicle)
    : channels_(channels), link_(link), gate_(vehicle), tracker_(Setpoint{}, vehicle) {
  link_.tap(&ControlLoop::on_frame, this);
}

void ControlLoop::record(study::RecordKind kind, std::int64_t t_ns, const void* bytes, std::size_t size) noexcept {
  ControlRecord r;
  r.header = {t_ns, kind, static_cast<std::uint32_t>(std::min(size, r.bytes.size()))};
  std::memcpy(r.bytes.data(), bytes, r.header.size);
  channels_.control_log.push(r);
}

void ControlLoop::on_frame(void* loop, bool outgoing, std::span<const std::uint8_t> frame) noexcept {
  auto& self = *static_cast<ControlLoop*>(loop);
  self.record(outgoing ? study::RecordKind::frame_out : study::RecordKind::frame_in, self.now_ns_, frame.data(),
              frame.size());
}

void ControlLoop::take_odometry(std::int64_t now_ns) noexcept {
  jump_ = fresh_ = false;
  const auto sample = channels_.odometry.read_new();
  if (!sample) return;
  ++view_.odometry_received;
  study::OdometryRecord r{};
  r.stamp_ns = sample->stamp_ns;
  std::copy_n(sample->state.p_W.data(), 3, r.p);
  std::copy_n(sample->state.v_W.data(), 3, r.v);
  std::copy_n(sample->q.data(), 4, r.q);
  record(study::RecordKind::odometry, sample->received_ns, &r, sizeof r);

  const bool moving = view_.command.v_W.norm() > 0.05;
  switch (gate_.take(*sample, moving)) {
    case OdometryGate::Verdict::good:
      last_good_ns_ = std::min(sample->received_ns, now_ns);
      fresh_ = true;
      return;
    case OdometryGate::Verdict::jump:
      jump_ = true;
      if (!was_commanding_) gate_.forget();
      [[fallthrough]];
    case OdometryGate::Verdict::rejected:
      ++view_.odometry_rejected;
  }
}

// Learns local ← map while nothing is commanded, watches it otherwise. The odometry is brought to the moment at which
// the controller's position arrived.
void ControlLoop::align(std::int64_t now_ns) noexcept {
  const auto& telemetry = link_.telemetry();
  if (!telemetry.local_state || !telemetry.attitude || !gate_.last() || !fresh_) return;
  if (telemetry.local_state->at == last_local_) return;
  last_local_ = telemetry.local_state->at;
  const OdometrySample& odometry = *gate_.last();
  const double dt = static_cast<double>(now_ns - odometry.received_ns) * 1e-9;
  const track::YawPose in_map{odometry.state.p_W + dt * odometry.state.v_W, yaw_of(attitude_of(odometry))};
  const track::YawPose in_local{telemetry.local_state->value.p_W, yaw_of(telemetry.attitude->value.q_LB)};
  alignment_.update(in_map, in_local, !was_commanding_);
}

void ControlLoop::take_segment() noexcept {
  new_segment_ = false;
  const track::AcceptedSegment* offered = channels_.segments.take();
  if (!offered) return;
  const bool commanding = supervisor_.mode() == track::Mode::tracking || supervisor_.mode() == track::Mode::hold;
  if (commanding && gate_.last() && tracker_.accept(*offered, gate_.last()->state)) {
    channels_.segments.give_back(std::exchange(segment_, offered));
    new_segment_ = true;
  } else {
    view_.refused_segment = offered->id;
    channels_.segments.give_back(offered);
  }
}

track::SupervisorInput ControlLoop::facts(std::int64_t now_ns, int missed) noexcept {
  const auto& telemetry = link_.telemetry();
  const auto heartbeat_age = link_.heartbeat_age(time_of(now_ns));
  track::SupervisorInput in;
  if (const auto request = channels_.requests.pop()) in.request = *request;
  in.odometry_age = last_good_ns_ < 0 ? kInfinity : static_cast<double>(now_ns - last_good_ns_) * 1e-9;
  in.odometry_jump = jump_;
  in.heartbeat_age = heartbeat_age ? std::chrono::duration<double>(*heartbeat_age).count() : kInfinity;
  in.armed = telemetry.status && telemetry.status->value.armed;
  in.offboard = telemetry.status && telemetry.status->value.follows_setpoints;
  in.landed = telemetry.landed_state && telemetry.landed_state->value == firmware_bridge::LandedState::kOnGround;
  in.frames_aligned = alignment_.aligned();
  in.inside = inside_.inside;
  in.new_segment = new_segment_;
  in.port_open = port_open_;
  in.transmit_failed = link_.transmit().missed_setpoints() >= firmware_bridge::kMaxMissedSetpoints;
  in.missed_periods = missed;
  return in;
}

void ControlLoop::send(const track::SupervisorOutput& out, const Setpoint& command, std::int64_t now_ns) noexcept {
  row_.sent = 0;
  if (out.changed && out.mode == track::Mode::quiet) link_.discard_unsent();
  if (out.send_setpoint && link_.send_setpoint(alignment_.to_local(command), time_of(now_ns))) {
    row_.sent |= 1;
    ++view_.setpoints;
    if (fresh_) {
      const double us = static_cast<double>(daemon::now_ns() - gate_.last()->received_ns) * 1e-3;
      view_.odometry_to_wire.add(us);
      row_.odometry_to_wire_us = static_cast<float>(us);
    }
  }
  if (out.send_heartbeat && view_.ticks % kTicksPerSecond == 0 && link_.send_heartbeat()) row_.sent |= 2;
  if (out.forward_odometry && fresh_) {
    const OdometrySample& s = *gate_.last();
    firmware_bridge::VioSample vio{};
    vio.time_us = static_cast<std::uint64_t>(s.stamp_ns / 1000);
    vio.p_O = s.state.p_W;
    vio.q_OB = attitude_of(s);
    vio.v_B = vio.q_OB.conjugate() * s.state.v_W;
    vio.omega_B = Vec3::Zero();
    if (link_.send_odometry(vio)) row_.sent |= 4;
  }
  if (out.request_offboard) link_.send_follow_setpoints();
  if (out.request_land) link_.send_land();
  if (out.mode == track::Mode::tracking && channels_.arm.exchange(false, std::memory_order_relaxed))
    link_.send_arm(true);
  // What the tick needs is asked for again every 2 s: an autopilot may have restarted.
  if (out.send_heartbeat && view_.ticks % (2 * kTicksPerSecond) == 1) {
    link_.send_message_interval(kLocalPositionNed, 50);
    link_.send_message_interval(kAttitudeQuaternion, 50);
    link_.send_message_interval(kExtendedSysState, 5);
  }
}

void ControlLoop::publish(const track::SupervisorOutput& out, std::int64_t now_ns) noexcept {
  const auto& telemetry = link_.telemetry();
  view_.t_ns = now_ns;
  view_.mode = out.mode;
  view_.reason = out.reason;
  view_.segment = tracker_.segment();
  view_.index = tracker_.index();
  view_.finished = tracker_.finished();
  view_.landed = !telemetry.landed_state || telemetry.landed_state->value == firmware_bridge::LandedState::kOnGround;
  view_.aligned = alignment_.aligned();
  view_.residual_m = alignment_.position_residual();
  view_.residual_rad = alignment_.yaw_residual();
  view_.frames_bad = link_.received().bad_crc;
  view_.page_faults = page_faults();
  if (gate_.last()) view_.state = gate_.last()->state;
  channels_.view_mission.write(view_);
  channels_.view_planner.write(view_);
  channels_.view_status.write(view_);

  row_.tick = view_.ticks;
  row_.mode = static_cast<std::uint32_t>(out.mode);
  row_.reason = static_cast<std::uint32_t>(out.reason);
  row_.judged = inside_.judged;
  row_.inside = inside_.inside;
  row_.frame_residual_m = static_cast<float>(view_.residual_m);
  row_.frame_residual_rad = static_cast<float>(view_.residual_rad);
  row_.page_faults = static_cast<std::uint32_t>(view_.page_faults);
  std::copy_n(view_.state.p_W.data(), 3, row_.p);
  std::copy_n(view_.state.v_W.data(), 3, row_.v);
  std::copy_n(view_.command.p_W.data(), 3, row_.cmd_p);
  std::copy_n(view_.command.v_W.data(), 3, row_.cmd_v);
  std::copy_n(view_.command.a_W.data(), 3, row_.cmd_a);
  row_.cmd_yaw = view_.command.yaw;
  std::copy_n(inside_.center.data(), 3, row_.center);
  std::copy(inside_.half_widths.begin(), inside_.half_widths.end(), row_.half_widths);
  record(study::RecordKind::tick, now_ns, &row_, sizeof row_);
}

void ControlLoop::tick(std::int64_t now_ns, int missed, double lateness_us) noexcept {
  now_ns_ = now_ns;
  row_ = {};
  row_.odometry_to_wire_us = -1;
  row_.missed_periods = static_cast<std::uint32_t>(missed);
  row_.compute_us = static_cast<float>(compute_us_);
  row_.lateness_us = static_cast<float>(lateness_us);
  if (view_.ticks > 0) view_.tick.add(compute_us_);
  view_.lateness.add(lateness_us);
  view_.missed += static_cast<std::uint64_t>(missed);

  port_open_ = link_.poll(time_of(now_ns)).has_value();
  take_odometry(now_ns);
  align(now_ns);
  take_segment();
  // The set predicted for this tick against the position measured for it.
  inside_ = track::Inside{};
  const bool tracking = supervisor_.mode() == track::Mode::tracking;
  if (tracking && gate_.last()) {
    row_.segment = tracker_.segment();
    row_.index = tracker_.index();
    if (fresh_) inside_ = tracker_.judge(gate_.last()->state.p_W);
    if (inside_.judged) ++(inside_.inside ? view_.inside : view_.outside);
  }

  const auto in = facts(now_ns, missed);
  view_.armed = in.armed;
  view_.offboard = in.offboard;
  view_.odometry_age = in.odometry_age;
  view_.heartbeat_age = in.heartbeat_age;
  const auto out = supervisor_.step(in);
  const bool commanding = out.mode == track::Mode::enabling || out.mode == track::Mode::tracking ||
                          out.mode == track::Mode::hold || out.mode == track::Mode::land;
  // A new start: hold where the vehicle is now.
  if (out.mode == track::Mode::enabling && !was_commanding_ && gate_.last()) {
    Setpoint here;
    here.p_W = gate_.last()->state.p_W;
    here.yaw = yaw_of(attitude_of(*gate_.last()));
    tracker_.hold_at(here);
    channels_.segments.give_back(std::exchange(segment_, nullptr));
  }
  was_commanding_ = commanding;
  if (out.mode == track::Mode::hold && out.changed) tracker_.hold_at(view_.command);
  view_.command = commanding ? tracker_.step() : tracker_.held();
  send(out, view_.command, now_ns);
  ++view_.ticks;
  publish(out, now_ns);
}

}  // namespace backwash::daemon

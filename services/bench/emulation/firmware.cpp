// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/emulation/firmware.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace backwash::bench {
namespace {

constexpr std::uint8_t kReal32 = 9;   // MAV_PARAM_TYPE
constexpr std::uint8_t kStation = 6;  // MAV_TYPE_GCS
constexpr double kFed = 0.05;         // s: without ODOMETRY for longer the inertial sensors alone carry the estimate on
constexpr double kContinuous = 0.3;   // s: a gap in ODOMETRY from which it counts as come back

Eigen::Matrix3d yaw_matrix(double yaw) { return Eigen::AngleAxisd(yaw, Vec3::UnitZ()).toRotationMatrix(); }

/// The firmware has its own gains and delays: what remains of the vehicle file is the body.
Vehicle without_controller(Vehicle v) {
  v.controller.kp = v.controller.kd = {0, 0};
  v.controller.latency = v.controller.feedback_delay = 0;
  return v;
}

}  // namespace

Firmware::Firmware(const Behaviour& behaviour, const Site& site)
    : Autopilot(site.grid, without_controller(site.vehicle), site.ground_W, site.frame, site.seed, site.system,
                site.airflow),
      uptime_(site.uptime),
      behaviour_(behaviour),
      drag_(site.drag) {
  parameters = behaviour.parameters;
  follows_yaw = true;
}

void Firmware::on(const mavlink::Odometry& m, double t) {
  const auto wrong = error_of(m);
  if (!wrong) return;
  if (since(odometry_at_, t) > kContinuous) odometry_since_ = t;
  if (!local_position_) error_ = wrong->error;
  odometry_at_ = t;
  measured_ = wrong->error;
  yaw_error_ = wrong->yaw;
  local_position_ = true;
}

void Firmware::estimate(double t) {
  const double unfed = since(odometry_at_, t);
  if (unfed < kFed) {
    const double share = 1 - std::exp(-kStep / behaviour_.fusion);
    error_.p_W += share * (measured_.p_W - error_.p_W);
    error_.v_W += share * (measured_.v_W - error_.v_W);
    drift_ = 0;
  } else if (local_position_) {
    const double more =
        std::min((behaviour_.drift + behaviour_.drift_rate * unfed) * kStep, behaviour_.drift_speed - drift_);
    drift_ += more;
    error_.v_W += more * (yaw_matrix(-frame_.yaw) * behaviour_.drift_way);
    error_.p_W += kStep * error_.v_W;
  }
  lost_ = lost_ ? unfed > kContinuous || since(odometry_since_, t) < behaviour_.estimator_found
                : local_position_ && unfed > behaviour_.estimator_lost;
}

// Answers leave one by one, at multiples of the period. A name that it does not know is not answered at all.
void Firmware::on(const mavlink::ParamRequestRead& m, double t) {
  const std::string name(m.param_id.begin(), std::ranges::find(m.param_id, char{0}));
  if (!parameters.contains(name)) return;
  const double period = behaviour_.parameter_period;
  const double next = std::ceil(t / period) * period;
  asked_.push_back({asked_.empty() ? next : std::max(next, asked_.back().due + period), name});
}

void Firmware::on(const mavlink::ParamSet& m, double t) {
  const std::string name(m.param_id.begin(), std::ranges::find(m.param_id, char{0}));
  const auto found = parameters.find(name);
  if (found == parameters.end()) return;
  const bool bytes = behaviour_.integers.contains(name) && behaviour_.autopilot.integers_bytewise;
  found->second = bytes ? std::bit_cast<std::int32_t>(m.param_value) : static_cast<double>(m.param_value);
  on(mavlink::ParamRequestRead{-1, 0, 0, m.param_id}, t);
}

void Firmware::on(const mavlink::Timesync& m, double) {
  if (m.tc1 == 0) syncs_.push_back({since_boot_ns(), m.ts1, 0, 0});
}

void Firmware::on(const mavlink::Heartbeat& m, double t) {
  if (m.type == kStation) station_at_ = t;
}

void Firmware::say(std::uint8_t severity, std::string_view text) {
  mavlink::Statustext m{.severity = severity};
  std::copy_n(text.begin(), std::min(text.size(), m.text.size()), m.text.begin());
  texts_.push_back(m);
}

std::array<AxisTarget, 3> Firmware::here() const {
  const State b = believed();
  const Vec3 a = yaw_matrix(yaw_error_) * acceleration();
  std::array<AxisTarget, 3> targets;
  for (int i = 0; i < 3; ++i) targets[static_cast<std::size_t>(i)] = {b.p_W[i], b.v_W[i], a[i]};
  return targets;
}

Vec3 Firmware::follow(const std::array<AxisTarget, 3>& targets, const LoopGains& horizontal, const LoopGains& vertical,
                      double speed_down, double speed_up) {
  const auto now = here();
  Vec3 u;
  for (std::size_t i = 0; i < 3; ++i) {
    const bool up = i == 2;
    u[static_cast<int>(i)] =
        loops_[i].step(up ? vertical : horizontal, targets[i], now[i].p, now[i].v, now[i].a,
                       up ? speed_down : kNoLimits.speed_down, up ? speed_up : kNoLimits.speed_up, kStep);
  }
  return u;
}

void Firmware::fly(double t) {
  estimate(t);
  const Vec3 u = armed_ ? control(t) : rest();
  vehicle_.command({truth().p_W, Vec3::Zero(), yaw_matrix(-yaw_error_) * u, target_.yaw - yaw_error_});
  const Vec3 gust = air_.step(truth().p_W, kStep);
  const bool free = armed_ && !grounded();
  vehicle_.step(free ? Vec3(gust - drag_ * truth().v_W) : Vec3::Zero(), truth());
  if (!grounded()) lifted_ = t;
  watch(t);
  landed_ = landed_state_ == on_ground;
}

std::uint8_t Firmware::set_interval(std::uint32_t id, double us) {
  if (us > 0)
    behaviour_.intervals_ms[id] = std::max(1, static_cast<int>(us * 1e-3));
  else
    behaviour_.intervals_ms.erase(id);
  return 0;
}

void Firmware::telemetry(double t, std::vector<std::uint8_t>& out) {
  for (const auto& ack : acks_) send(ack, out);
  for (const auto& text : texts_) send(text, out);
  for (const auto& sync : syncs_) send(sync, out);
  acks_.clear();
  texts_.clear();
  syncs_.clear();
  for (; !asked_.empty() && asked_.front().due <= t; asked_.pop_front()) {
    const std::string& name = asked_.front().name;
    const auto type = behaviour_.integers.find(name);
    const bool integer = type != behaviour_.integers.end();
    const double value = parameters.at(name);
    mavlink::ParamValue m{.param_count = 1, .param_type = integer ? type->second : kReal32};
    m.param_value = integer && behaviour_.autopilot.integers_bytewise
                        ? std::bit_cast<float>(static_cast<std::int32_t>(value))
                        : static_cast<float>(value);
    std::copy_n(name.begin(), std::min(name.size(), m.param_id.size()), m.param_id.begin());
    send(m, out);
  }
  if (mute) return out.clear();
  const bool asked = behaviour_.intervals_ms.contains(mavlink::Heartbeat::kId);
  if ((!asked && steps_ % 1000 == 0) || heartbeat_due_) send(heartbeat(), out);
  heartbeat_due_ = false;
  for (const auto& [id, every] : behaviour_.intervals_ms) {
    if (steps_ % every != 0) continue;
    if (id == mavlink::Heartbeat::kId) send(heartbeat(), out);
    if (id == mavlink::AttitudeQuaternion::kId && !silent_attitude) send_attitude(out);
    if (id == mavlink::LocalPositionNed::kId && local_position_ && !silent_pose) send_position(out);
    if (id == mavlink::ExtendedSysState::kId) send(mavlink::ExtendedSysState{0, landed_state_}, out);
    if (id == mavlink::BatteryStatus::kId) send_battery(out);
    if (id == mavlink::Timesync::kId) send(mavlink::Timesync{0, since_boot_ns(), 0, 0}, out);
  }
}

}  // namespace backwash::bench

// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/telemetry.hpp"

#include <utility>

#include "firmware_bridge/mavlink/frames.hpp"

namespace backwash::firmware_bridge {
namespace {

// Values of common.xml.
constexpr std::uint8_t kCustomModeEnabled = 1, kSafetyArmed = 128;
constexpr std::uint32_t kPrearmCheck = 1U << 28;  // of SYS_STATUS's sensors
constexpr std::uint16_t kNoCell = 65535, kNoVoltage = 65535;

// What a local frame and a vehicle indoors never reach; a float resolves 1 mm at 10 km. Written so that what is no
// number is not sane.
constexpr double kFarthest = 10'000, kFastest = 100, kFastestTurn = 100;  // m, m/s, rad/s
bool sane(const Vec3& v, double most) noexcept { return v.norm() <= most; }

std::array<char, 16> parameter_id(std::string_view name) noexcept {
  std::array<char, 16> id{};
  std::ranges::copy(name.substr(0, id.size()), id.begin());
  return id;
}

/// Of MAVLink's 10 mA; −1: not known.
std::optional<double> amperes(std::int16_t current) noexcept {
  return current == -1 ? std::nullopt : std::optional(current / 100.0);
}

std::optional<double> share(std::int8_t percent) noexcept {
  if (percent < 0 || percent > 100) return std::nullopt;
  return percent / 100.0;
}

}  // namespace

void Telemetry::take(const mavlink::Heartbeat& m, Time now) noexcept {
  const AutopilotProfile& autopilot = profile_of(m.autopilot, among_);
  const bool follows = (m.base_mode & kCustomModeEnabled) != 0 && autopilot.follows_in(m.custom_mode);
  const VehicleStatus s{&autopilot, (m.base_mode & kSafetyArmed) != 0, follows, m.custom_mode, m.system_status};
  const auto age = status.age(now);
  if (std::exchange(autopilot_, &autopilot) != &autopilot || (age && *age >= kHeartbeatTimeout)) restarted();  // it may
  status.take(s, now);
}

bool Telemetry::in_order(std::optional<std::uint32_t>& last_ms, std::uint32_t now_ms) noexcept {
  // A clock more than a second back is a restarted controller, not a late packet: faster than its silence shows.
  const auto ahead = last_ms ? static_cast<std::int32_t>(now_ms - *last_ms) : 0;
  if (ahead < 0 && ahead > -1000) {
    ++out_of_order;
    return false;
  }
  if (ahead < 0) restarted();
  last_ms = now_ms;
  return true;
}

void Telemetry::take(const mavlink::LocalPositionNed& m, Time now) noexcept {
  const State s{mavlink::swap_ned({m.x, m.y, m.z}), mavlink::swap_ned({m.vx, m.vy, m.vz})};
  if (!sane(s.p_W, kFarthest) || !sane(s.v_W, kFastest)) {
    ++broken;
    return;
  }
  if (in_order(position_ms_, m.time_boot_ms)) local_state.take(s, now);
}

void Telemetry::take_attitude(const Eigen::Quaterniond& q_NF, const Vec3& omega_F, std::uint32_t time_boot_ms,
                              Time now) noexcept {
  const double norm = q_NF.norm();
  if (!(std::abs(norm - 1) < 0.01) || !sane(omega_F, kFastestTurn)) {
    ++broken;
    return;
  }
  const VehicleAttitude a{mavlink::swap_ned_frd(q_NF.normalized()), mavlink::swap_frd(omega_F)};
  if (in_order(attitude_ms_, time_boot_ms)) attitude.take(a, now);
}

void Telemetry::take(const mavlink::AttitudeQuaternion& m, Time now) noexcept {
  take_attitude({m.q1, m.q2, m.q3, m.q4}, {m.rollspeed, m.pitchspeed, m.yawspeed}, m.time_boot_ms, now);
}

void Telemetry::take(const mavlink::Attitude& m, Time now) noexcept {
  const Eigen::Quaterniond q_NF = Eigen::AngleAxisd(m.yaw, Vec3::UnitZ()) * Eigen::AngleAxisd(m.pitch, Vec3::UnitY()) *
                                  Eigen::AngleAxisd(m.roll, Vec3::UnitX());
  take_attitude(q_NF, {m.rollspeed, m.pitchspeed, m.yawspeed}, m.time_boot_ms, now);
}

void Telemetry::take(const mavlink::Odometry& m, Time now) noexcept {
  reset_counter.take(m.reset_counter, now);
  // x, y and z on the diagonal of the upper triangle; the first is NaN where nothing is known.
  const double variance = std::max({m.pose_covariance[0], m.pose_covariance[6], m.pose_covariance[11]});
  if (std::isfinite(m.pose_covariance[0]) && std::isfinite(variance) && variance > 0)
    position_sigma.take(std::sqrt(variance), now);
}

void Telemetry::take(const mavlink::BatteryStatus& m, Time now) noexcept {
  if (m.id != 0) return;
  battery_status_seen_ = true;
  Battery b{std::nullopt, share(m.battery_remaining), amperes(m.current_battery)};
  double millivolts = 0;
  for (const auto cell : m.voltages) millivolts += cell == kNoCell ? 0 : cell;
  for (const auto cell : m.voltages_ext) millivolts += cell == kNoCell ? 0 : cell;
  if (millivolts > 0) b.voltage = millivolts / 1000;
  battery.take(b, now);
}

void Telemetry::take(const mavlink::SysStatus& m, Time now) noexcept {
  if ((m.onboard_control_sensors_present & kPrearmCheck) != 0)
    would_arm.take((m.onboard_control_sensors_health & kPrearmCheck) != 0, now);
  if (battery_status_seen_) return;
  Battery b{std::nullopt, share(m.battery_remaining), amperes(m.current_battery)};
  if (m.voltage_battery != kNoVoltage && m.voltage_battery != 0) b.voltage = m.voltage_battery / 1000.0;
  if (b.voltage || b.remaining) battery.take(b, now);
}

void Telemetry::take(const mavlink::ExtendedSysState& m, Time now) noexcept {
  if (m.landed_state > static_cast<std::uint8_t>(LandedState::landing)) {
    ++broken;
    return;
  }
  landed_state.take(static_cast<LandedState>(m.landed_state), now);
}

void Telemetry::take(const mavlink::CommandAck& m, Time now) noexcept {
  const Received<CommandResult> answer{{m.command, m.result}, now};
  for (auto& r : results_) {
    if (r && r->value.command == m.command) {
      r = answer;
      return;
    }
  }
  results_[next_result_] = answer;
  next_result_ = (next_result_ + 1) % results_.size();
}

Latest<CommandResult> Telemetry::result_of(std::uint16_t command) const noexcept {
  for (const auto& r : results_) {
    if (r && r->value.command == command) return r;
  }
  return std::nullopt;
}

void Telemetry::take(const mavlink::Statustext& m, Time now) noexcept {
  StatusLine line{m.severity, {}};
  std::ranges::copy(m.text, line.text.begin());
  text = {line, now};
}

template <class Each>
void Telemetry::each_named(const std::array<char, 16>& id, Each&& each) noexcept {
  const std::span<const ParameterRule> rules = autopilot_->rules;
  for (std::size_t n = 0; n < rules.size(); ++n)
    for (std::uint8_t name = 0; name < rules[n].count(); ++name)
      if (parameter_id(rules[n].names[name].name) == id) each(n, name);
}

void Telemetry::take(const mavlink::ParamValue& m, Time) noexcept {
  constexpr std::uint8_t kInt32 = 6;
  double value = static_cast<double>(m.param_value);
  if (autopilot_->integers_bytewise && m.param_type == kInt32) value = std::bit_cast<std::int32_t>(m.param_value);
  const bool number = std::isfinite(value);
  if (!number) ++broken;
  each_named(m.param_id, [&](std::size_t rule, std::uint8_t name) {
    parameters_[rule] = {};  // what it was before is not believed any more
    if (!number) return;
    parameters_[rule].value = value;
    parameters_[rule].name = name;
    if (autopilot_->rules[rule].count() > 1) generation_ = name;
  });
}

void Telemetry::take(const mavlink::ParamError& m, Time) noexcept {
  constexpr std::uint8_t kDoesNotExist = 1;
  if (m.error != kDoesNotExist) return;
  each_named(m.param_id, [&](std::size_t rule, std::uint8_t name) {
    if (!parameters_[rule].value) parameters_[rule].lacks |= static_cast<std::uint8_t>(1u << name);
  });
}

std::string_view Telemetry::ask(std::size_t rule) noexcept {
  const ParameterRule& asked = autopilot_->rules[rule];
  ParameterAnswer& answer = parameters_[rule];
  std::size_t name = answer.value ? answer.name : (answer.asked + generation_) % asked.count();
  if (answer.lacks >> name & 1) name = (name + 1) % asked.count();
  if (!answer.value && answer.asked < UINT8_MAX) ++answer.asked;
  return asked.names[name].name;
}

void Telemetry::take(const mavlink::AutopilotVersion& m, Time) noexcept {
  const auto part = [&](int shift) { return static_cast<std::uint8_t>(m.flight_sw_version >> shift); };
  version = {part(24), part(16), part(8)};
}

void Telemetry::take_estimator(std::uint16_t flags, Time now) noexcept {
  // ESTIMATOR_STATUS_FLAGS, EKF_STATUS_FLAGS. PX4 says from 1.16 on by PRED_POS_HORIZ_REL that a sensor aids it, and
  // CONST_POS_MODE (128) also of a vehicle at rest (get_ekf_soln_status); elsewhere it is as POS_HORIZ_REL.
  constexpr unsigned kPosition = 8 + 16, kAided = 256;
  estimator_follows.take((flags & kPosition) != 0 && (flags & kAided) != 0, now);
}

void Telemetry::restarted() noexcept {
  parameters_ = {};
  version.reset();
  has_origin = false;
}

}  // namespace backwash::firmware_bridge

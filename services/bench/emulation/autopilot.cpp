// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/emulation/autopilot.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <iomanip>

#include "firmware_bridge/mavlink/frames.hpp"

namespace backwash::bench {
namespace {

// Values of common.xml and of PX4's custom modes.
constexpr std::uint8_t kQuadrotor = 2, kArmedFlag = 128, kCustomFlag = 1, kActive = 4, kStandby = 3;
constexpr std::uint32_t kManual = 1u << 16, kOffboard = 6u << 16, kAutoLand = 4u << 16 | 6u << 24;
constexpr std::uint16_t kSetMode = 176, kArm = 400, kLand = 21, kMessageInterval = 511;
constexpr std::uint8_t kAccepted = 0, kTemporarilyRejected = 1, kUnsupported = 3;
constexpr double kHistory = 1.0;                    // s
constexpr long kReportEvery = 20;                   // steps, position and attitude
constexpr double kLeastCharge = 0.3, kDrain = 900;  // share; s

Eigen::Matrix3d yaw_matrix(double yaw) { return Eigen::AngleAxisd(yaw, Vec3::UnitZ()).toRotationMatrix(); }

}  // namespace

void take_gains(const firmware_bridge::AutopilotProfile& autopilot, const Vehicle& vehicle,
                std::map<std::string, double>& parameters) {
  using firmware_bridge::Ask;
  for (const auto& rule : autopilot.rules) {
    if (rule.ask < Ask::k_d_horizontal || rule.ask > Ask::k_p_vertical) continue;
    for (const auto& [name, scale] : rule.names)
      if (const auto own = parameters.find(std::string(name)); own != parameters.end())
        own->second = scale * firmware_bridge::wanted(rule, vehicle);
  }
}

Autopilot::Autopilot(const map::OccupancyGrid& grid, const Vehicle& vehicle, const Vec3& ground_W,
                     const LocalFrame& frame, std::uint64_t seed, std::uint8_t system, double airflow)
    : vehicle_(vehicle, State{ground_W, Vec3::Zero()}, ground_W.z()),
      air_(grid, vehicle, seed, airflow),
      frame_(frame),
      system_(system) {
  vehicle_.set_motors(false);
  target_.p_W = ground_W;
  take_gains(firmware_bridge::kPx4, vehicle, parameters);
}

bool Autopilot::log_wire(const std::string& path) {
  wire_.open(path);
  wire_ << "t_s,id,sequence,type_mask,x,y,z\n" << std::setprecision(15);
  return wire_.good();
}

const char* Autopilot::mode() const noexcept {
  return mode_ == Mode::offboard ? "offboard" : mode_ == Mode::land ? "land" : "manual";
}

Setpoint Autopilot::target_of(const mavlink::SetPositionTargetLocalNed& m) const {
  const Eigen::Matrix3d R = yaw_matrix(-frame_.yaw);
  return {R * (mavlink::swap_ned({m.x, m.y, m.z}) - frame_.origin), R * mavlink::swap_ned({m.vx, m.vy, m.vz}),
          R * mavlink::swap_ned({m.afx, m.afy, m.afz}), mavlink::swap_yaw(m.yaw) - frame_.yaw};
}

// The estimator: the truth as its inertial sensors would carry it on, plus what the odometry had wrong.
State Autopilot::believed() const {
  const Eigen::Matrix3d R = yaw_matrix(yaw_error_);
  return {R * truth().p_W + error_.p_W, R * truth().v_W + error_.v_W};
}

// An estimator whose heading is wrong turns everything that it asks of the vehicle. The simulated controller sees but
// differences, so what it is given is turned back about the place where the estimator believes to be.
State Autopilot::felt() const { return {believed().p_W, yaw_matrix(-yaw_error_) * believed().v_W}; }

void Autopilot::steer() {
  const Eigen::Matrix3d R = yaw_matrix(-yaw_error_);
  const Vec3 here = believed().p_W;
  vehicle_.command({here + R * (target_.p_W - here), R * target_.v_W, R * target_.a_W, target_.yaw - yaw_error_});
}

// As gyros measure it, FLU: the mean since the report before.
Vec3 Autopilot::body_rates() {
  const Eigen::Quaterniond turn = reported_.conjugate() * attitude();
  const auto elapsed = static_cast<double>(std::max(steps_ - reported_steps_, 1L)) * sim::Quadrotor::kStep;
  reported_ = attitude();
  reported_steps_ = steps_;
  return (turn.w() < 0 ? -2 : 2) / elapsed * turn.vec();
}

void Autopilot::on(const mavlink::SetPositionTargetLocalNed& m, double t) {
  last_setpoint_ = t;
  ++setpoints_;
  if (mode_ == Mode::offboard && armed_) {
    target_ = target_of(m);
    steer();
  }
}

void Autopilot::on(const mavlink::Odometry& m, double) {
  const auto wrong = error_of(m);
  if (!wrong) return;
  error_ = wrong->error;
  yaw_error_ = wrong->yaw;
  local_position_ = true;
}

std::optional<Autopilot::OdometryError> Autopilot::error_of(const mavlink::Odometry& m) const {
  const double stamp = static_cast<double>(m.time_usec) * 1e-6;
  const auto then = std::find_if(history_.begin(), history_.end(), [&](const Truth& h) { return h.t >= stamp; });
  if (then == history_.end()) return std::nullopt;
  const Vec3 p = mavlink::swap_ned({m.x, m.y, m.z});
  const Eigen::Quaterniond q = mavlink::swap_ned_frd(Eigen::Quaterniond(m.q[0], m.q[1], m.q[2], m.q[3]));
  const Vec3 v = q * mavlink::swap_frd({m.vx, m.vy, m.vz});
  const Vec3 x = q * Vec3::UnitX(), x_then = then->attitude * Vec3::UnitX();
  const double yaw = follows_yaw ? std::atan2(x.y(), x.x()) - std::atan2(x_then.y(), x_then.x()) : 0;
  const Eigen::Matrix3d R = yaw_matrix(yaw);
  return OdometryError{{p - R * then->state.p_W, v - R * then->state.v_W}, yaw};
}

void Autopilot::on(const mavlink::CommandLong& m, double t) {
  std::uint8_t result = kUnsupported;
  if (m.command == kSetMode) {
    // Offboard needs set-points that already stream.
    const bool streaming = since(last_setpoint_, t) < kOffboardTimeout;
    result = m.param2 == 6 && streaming ? kAccepted : kTemporarilyRejected;
    if (result == kAccepted) mode_ = Mode::offboard;
  } else if (m.command == kArm) {
    // Not forced, so that it is no way to fall.
    result = m.param1 == 1 || landed_ ? kAccepted : kTemporarilyRejected;
    if (result == kAccepted) armed_ = m.param1 == 1;
    vehicle_.set_motors(armed_);
  } else if (m.command == kLand) {
    if (mode_ != Mode::land) target_ = {believed().p_W, Vec3::Zero(), Vec3::Zero(), target_.yaw};
    mode_ = Mode::land;
    result = kAccepted;
  } else if (m.command == kMessageInterval) {
    result = kAccepted;  // everything is sent at its rate anyway
  }
  acks_.push_back({.command = m.command, .result = result});
}

// As PX4 answers: integers bytewise in the float.
void Autopilot::on(const mavlink::ParamRequestRead& m, double) {
  constexpr std::uint8_t kInt32 = 6, kReal32 = 9;
  const std::string name(m.param_id.begin(), std::ranges::find(m.param_id, char{0}));
  const auto found = parameters.find(name);
  if (found == parameters.end()) return;
  const bool real = name.ends_with("_T") || name.ends_with("_DELAY") || name.starts_with("MPC_");
  mavlink::ParamValue answer{.param_count = 1, .param_id = m.param_id, .param_type = real ? kReal32 : kInt32};
  answer.param_value =
      real ? static_cast<float>(found->second) : std::bit_cast<float>(static_cast<std::int32_t>(found->second));
  values_.push_back(answer);
}

void Autopilot::receive(std::span<const std::uint8_t> bytes, double t) {
  parser_.feed(bytes, [&](const mavlink::Frame& frame) {
    mavlink::decode_and_visit(frame.id, frame.payload, [&](const auto& message) {
      if (wire_.is_open()) {
        wire_ << t << ',' << frame.id << ',' << int{frame.sender.sequence};
        if constexpr (std::is_same_v<std::decay_t<decltype(message)>, mavlink::SetPositionTargetLocalNed>)
          wire_ << ',' << message.type_mask << ',' << message.x << ',' << message.y << ',' << message.z << '\n';
        else if constexpr (std::is_same_v<std::decay_t<decltype(message)>, mavlink::CommandLong>)
          wire_ << ',' << message.command << ',' << message.param1 << ',' << message.param2 << ',' << message.param7
                << '\n';
        else
          wire_ << ",,,,\n";
      }
      on(message, t);
    });
  });
}

void Autopilot::fly(double t) {
  // The controller's own failsafe: offboard without a stream becomes a landing (PX4's COM_OF_LOSS_T).
  if (mode_ == Mode::offboard && armed_ && since(last_setpoint_, t) > kOffboardTimeout) {
    mode_ = Mode::land;
    target_ = {believed().p_W, Vec3::Zero(), Vec3::Zero(), target_.yaw};
  }
  if (mode_ == Mode::land && armed_ && steps_ % 20 == 0) {
    target_.v_W = {0, 0, -kDescent};
    target_.p_W.z() = std::max(target_.p_W.z() - kDescent * 0.02, believed().p_W.z() - 0.5);
    steer();
  }
  const Vec3 gust = air_.step(truth().p_W, sim::Quadrotor::kStep);
  vehicle_.step(armed_ && !vehicle_.on_ground() ? gust : Vec3::Zero(), felt());
  if (!vehicle_.on_ground()) landed_since_ = t;
  landed_ = t - landed_since_ > 0.2;
  if (mode_ == Mode::land && armed_ && t - landed_since_ > 0.5) {
    armed_ = false;
    mode_ = Mode::manual;
    vehicle_.set_motors(false);
  }
}

void Autopilot::telemetry(double, std::vector<std::uint8_t>& out) {
  for (const auto& ack : acks_) send(ack, out);
  acks_.clear();
  for (const auto& value : values_) send(value, out);
  values_.clear();
  if (mute) return out.clear();
  if (steps_ % 1000 == 500) send_battery(out);
  if (steps_ % 1000 == 0 || heartbeat_due_) {
    heartbeat_due_ = false;
    const std::uint32_t custom = mode_ == Mode::offboard ? kOffboard : mode_ == Mode::land ? kAutoLand : kManual;
    send(mavlink::Heartbeat{.custom_mode = custom,
                            .type = kQuadrotor,
                            .autopilot = firmware_bridge::kPx4.number,
                            .base_mode = static_cast<std::uint8_t>(kCustomFlag | (armed_ ? kArmedFlag : 0)),
                            .system_status = armed_ ? kActive : kStandby,
                            .mavlink_version = 3},
         out);
  }
  if (steps_ % 200 == 0) {
    const std::uint8_t state = landed_ ? 1 : mode_ == Mode::land ? 4 : 2;
    send(mavlink::ExtendedSysState{.vtol_state = 0, .landed_state = state}, out);
  }
  if (steps_ % kReportEvery == 0 && !silent_attitude) send_attitude(out);
  if (steps_ % kReportEvery == 0 && local_position_ && !silent_pose) send_position(out);
}

void Autopilot::send_attitude(std::vector<std::uint8_t>& out) {
  const Eigen::Quaterniond q =
      mavlink::swap_ned_frd(Eigen::Quaterniond(yaw_matrix(frame_.yaw + yaw_error_)) * attitude());
  const Eigen::Vector3f omega = mavlink::swap_frd(body_rates()).cast<float>();
  send(mavlink::AttitudeQuaternion{.time_boot_ms = static_cast<std::uint32_t>(steps_),
                                   .q1 = static_cast<float>(q.w()),
                                   .q2 = static_cast<float>(q.x()),
                                   .q3 = static_cast<float>(q.y()),
                                   .q4 = static_cast<float>(q.z()),
                                   .rollspeed = omega.x(),
                                   .pitchspeed = omega.y(),
                                   .yawspeed = omega.z()},
       out);
}

void Autopilot::send_position(std::vector<std::uint8_t>& out) {
  const State b = believed();
  const Eigen::Vector3f p = mavlink::swap_ned(yaw_matrix(frame_.yaw) * b.p_W + frame_.origin).cast<float>();
  const Eigen::Vector3f v = mavlink::swap_ned(yaw_matrix(frame_.yaw) * b.v_W).cast<float>();
  send(mavlink::LocalPositionNed{static_cast<std::uint32_t>(steps_), p.x(), p.y(), p.z(), v.x(), v.y(), v.z()}, out);
}

double Autopilot::charge() const noexcept {
  return kLeastCharge + (1 - kLeastCharge) * std::exp(-1e-3 * static_cast<double>(armed_steps_) / kDrain);
}

void Autopilot::send_battery(std::vector<std::uint8_t>& out) {
  const double share = battery.value_or(charge());
  mavlink::BatteryStatus status{.current_battery = -1,
                                .battery_remaining = static_cast<std::int8_t>(std::lround(100 * share))};
  status.voltages.fill(65535);
  std::fill_n(status.voltages.begin(), 4, static_cast<std::uint16_t>(std::lround(3500 + 650 * share)));
  send(status, out);
}

void Autopilot::step(double t, std::vector<std::uint8_t>& out) {
  fly(t);
  history_.push_back({t, truth(), attitude()});
  while (history_.front().t < t - kHistory) history_.pop_front();
  telemetry(t, out);
  armed_steps_ += armed_ ? 1 : 0;
  ++steps_;
}

}  // namespace backwash::bench

// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/autopilot.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <iomanip>

#include "firmware_bridge/mavlink/frames.hpp"

namespace backwash::bench {
namespace {

// Values of common.xml and of PX4's custom modes.
constexpr std::uint8_t kQuadrotor = 2, kPx4 = 12, kArmedFlag = 128, kCustomFlag = 1, kActive = 4, kStandby = 3;
constexpr std::uint32_t kManual = 1u << 16, kOffboard = 6u << 16, kAutoLand = 4u << 16 | 6u << 24;
constexpr std::uint16_t kSetMode = 176, kArm = 400, kLand = 21, kMessageInterval = 511;
constexpr std::uint8_t kAccepted = 0, kTemporarilyRejected = 1, kUnsupported = 3;
constexpr double kHistory = 1.0;  // s

Eigen::Matrix3d yaw_matrix(double yaw) { return Eigen::AngleAxisd(yaw, Vec3::UnitZ()).toRotationMatrix(); }

}  // namespace

Autopilot::Autopilot(const map::OccupancyGrid& grid, const Vehicle& vehicle, const Vec3& ground_W,
                     const LocalFrame& frame, std::uint64_t seed, std::uint8_t system)
    : vehicle_(vehicle, State{ground_W, Vec3::Zero()}, ground_W.z()),
      air_(grid, vehicle, seed),
      frame_(frame),
      system_(system) {
  vehicle_.set_motors(false);
  target_.p_W = ground_W;
}

void Autopilot::log_wire(const std::string& path) {
  wire_.open(path);
  wire_ << "t_s,id,sequence,type_mask,x,y,z\n" << std::setprecision(15);
}

const char* Autopilot::mode() const noexcept {
  return mode_ == Mode::offboard ? "offboard" : mode_ == Mode::land ? "land" : "manual";
}

void Autopilot::take_over() noexcept {
  mode_ = Mode::manual;
  heartbeat_due_ = true;
}

void Autopilot::disarm() noexcept {
  armed_ = false;
  vehicle_.set_motors(false);
  heartbeat_due_ = true;
}

Setpoint Autopilot::to_map(const Setpoint& local) const {
  const Eigen::Matrix3d R = yaw_matrix(-frame_.yaw);
  return {R * (local.p_W - frame_.origin), R * local.v_W, R * local.a_W, local.yaw - frame_.yaw};
}

// The estimator: the truth as its inertial sensors would carry it on, plus what the odometry had wrong.
State Autopilot::believed() const { return {truth().p_W + error_.p_W, truth().v_W + error_.v_W}; }

void Autopilot::on(const mavlink::SetPositionTargetLocalNed& m, double t) {
  last_setpoint_ = t;
  ++setpoints_;
  Setpoint local;
  local.p_W = mavlink::swap_ned({m.x, m.y, m.z});
  local.v_W = mavlink::swap_ned({m.vx, m.vy, m.vz});
  local.a_W = mavlink::swap_ned({m.afx, m.afy, m.afz});
  local.yaw = mavlink::swap_yaw(m.yaw);
  if (mode_ == Mode::offboard && armed_) {
    target_ = to_map(local);
    vehicle_.command(target_);
  }
}

void Autopilot::on(const mavlink::Odometry& m, double) {
  const double stamp = static_cast<double>(m.time_usec) * 1e-6;
  const auto then = std::find_if(history_.begin(), history_.end(), [&](const auto& h) { return h.first >= stamp; });
  if (then == history_.end()) return;
  const Vec3 p = mavlink::swap_ned({m.x, m.y, m.z});
  const Eigen::Quaterniond q = mavlink::swap_ned_frd(Eigen::Quaterniond(m.q[0], m.q[1], m.q[2], m.q[3]));
  const Vec3 v = q * mavlink::swap_frd({m.vx, m.vy, m.vz});
  error_ = {p - then->second.p_W, v - then->second.v_W};
  local_position_ = true;
}

void Autopilot::on(const mavlink::CommandLong& m, double t) {
  std::uint8_t result = kUnsupported;
  if (m.command == kSetMode) {
    // Offboard needs set-points that already stream.
    const bool streaming = t - last_setpoint_ < kOffboardTimeout;
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
  const bool real = name.ends_with("_T");
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
        else
          wire_ << ",,,,\n";
      }
      on(message, t);
    });
  });
}

void Autopilot::fly(double t) {
  // The controller's own failsafe: offboard without a stream becomes a landing (PX4's COM_OF_LOSS_T).
  if (mode_ == Mode::offboard && armed_ && t - last_setpoint_ > kOffboardTimeout) {
    mode_ = Mode::land;
    target_ = {believed().p_W, Vec3::Zero(), Vec3::Zero(), target_.yaw};
  }
  if (mode_ == Mode::land && armed_ && steps_ % 20 == 0) {
    target_.v_W = {0, 0, -kDescent};
    target_.p_W.z() = std::max(target_.p_W.z() - kDescent * 0.02, believed().p_W.z() - 0.5);
    vehicle_.command(target_);
  }
  const Vec3 gust = air_.step(truth().p_W, sim::Quadrotor::kStep);
  vehicle_.step(armed_ && !vehicle_.on_ground() ? gust : Vec3::Zero(), believed());
  if (!vehicle_.on_ground()) landed_since_ = t;
  landed_ = t - landed_since_ > 0.2;
  if (mode_ == Mode::land && armed_ && t - landed_since_ > 0.5) {
    armed_ = false;
    mode_ = Mode::manual;
    vehicle_.set_motors(false);
  }
}

template <typename Message>
void Autopilot::send(const Message& message, std::vector<std::uint8_t>& out) {
  const auto frame = mavlink::encode_frame({system_, 1, sequence_++}, message);
  out.insert(out.end(), frame.view().begin(), frame.view().end());
}

void Autopilot::telemetry(double t, std::vector<std::uint8_t>& out) {
  const auto boot_ms = static_cast<std::uint32_t>(steps_);
  for (const auto& ack : acks_) send(ack, out);
  acks_.clear();
  for (const auto& value : values_) send(value, out);
  values_.clear();
  if (mute) return out.clear();
  if (battery && steps_ % 1000 == 500) {
    mavlink::BatteryStatus status{.battery_remaining = static_cast<std::int8_t>(std::lround(100 * *battery))};
    status.voltages.fill(65535);
    send(status, out);
  }
  if (steps_ % 1000 == 0 || heartbeat_due_) {
    heartbeat_due_ = false;
    const std::uint32_t custom = mode_ == Mode::offboard ? kOffboard : mode_ == Mode::land ? kAutoLand : kManual;
    send(mavlink::Heartbeat{.custom_mode = custom,
                            .type = kQuadrotor,
                            .autopilot = kPx4,
                            .base_mode = static_cast<std::uint8_t>(kCustomFlag | (armed_ ? kArmedFlag : 0)),
                            .system_status = armed_ ? kActive : kStandby,
                            .mavlink_version = 3},
         out);
  }
  if (steps_ % 200 == 0) {
    const std::uint8_t state = landed_ ? 1 : mode_ == Mode::land ? 4 : 2;
    send(mavlink::ExtendedSysState{.vtol_state = 0, .landed_state = state}, out);
  }
  if (steps_ % 20 == 0) {
    const Eigen::Quaterniond q = mavlink::swap_ned_frd(Eigen::Quaterniond(yaw_matrix(frame_.yaw)) * attitude());
    send(mavlink::AttitudeQuaternion{.time_boot_ms = boot_ms,
                                     .q1 = static_cast<float>(q.w()),
                                     .q2 = static_cast<float>(q.x()),
                                     .q3 = static_cast<float>(q.y()),
                                     .q4 = static_cast<float>(q.z())},
         out);
    if (local_position_) {
      const State b = believed();
      const Eigen::Vector3f p = mavlink::swap_ned(yaw_matrix(frame_.yaw) * b.p_W + frame_.origin).cast<float>();
      const Eigen::Vector3f v = mavlink::swap_ned(yaw_matrix(frame_.yaw) * b.v_W).cast<float>();
      send(mavlink::LocalPositionNed{boot_ms, p.x(), p.y(), p.z(), v.x(), v.y(), v.z()}, out);
    }
  }
  (void)t;
}

void Autopilot::step(double t, std::vector<std::uint8_t>& out) {
  t_ = t;
  fly(t);
  history_.emplace_back(t, truth());
  while (history_.front().first < t - kHistory) history_.pop_front();
  telemetry(t, out);
  ++steps_;
}

}  // namespace backwash::bench

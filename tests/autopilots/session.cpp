// SPDX-License-Identifier: BSD-3-Clause
#include "tests/autopilots/session.hpp"

#include <bit>
#include <fstream>
#include <iomanip>
#include <iostream>

#include "firmware_bridge/mavlink/frames.hpp"

namespace backwash::autopilots {
namespace {

constexpr std::uint8_t kCompanion = 191, kStationSystem = 255, kStation = 190;
constexpr std::uint8_t kLocalNed = 1, kLocalFrd = 20, kBodyFrd = 12, kVio = 3;

template <std::size_t N>
std::string text_of(const std::array<char, N>& zero_filled) {
  return {zero_filled.begin(), std::ranges::find(zero_filled, char{0})};
}

}  // namespace

Session::Session(Line line, const Options& options, std::ostream& trace)
    : o_(options), peer_(line, kSystem, kCompanion), station_(line, kStationSystem, kStation), trace_(trace) {
  trace_ << "t_s,who,what,a,b,c,d,e,f,g\n" << std::fixed << std::setprecision(4);
  read(o_.script);
}

bool Session::step(std::int64_t now_ns, const std::optional<Truth>& truth) {
  if (ms_ == 0) begun_ns_ = now_ns;
  now_ns_ = now_ns;
  t_ = static_cast<double>(now_ns - begun_ns_) * 1e-9;
  peer_.poll([&](const mavlink::Sender& from, const auto& m) {
    if (from.component == kFlightController) on(m);
  });
  if (truth) forward(*truth);
  if (ms_ % 1000 == 0) peer_.send(mavlink::Heartbeat{0, 18, 8, 0, 4, 3});
  if (watched_ && ms_ % 1000 == 0) station_.send(mavlink::Heartbeat{0, 6, 8, 0, 4, 3});
  if (sticks_ && ms_ % 50 == 0) station_.send(mavlink::ManualControl{.z = 500, .target = kSystem});
  if (ms_ % 20 == 0) stream();
  ++ms_;
  return advance();
}

void Session::finish() {
  for (const auto& [name, count] : counts_) row("end", std::string(name), {double(count), double(count) / t_});
}

/// The lines of a script; `include FILE` stands for those of another beside it.
void Session::read(const std::filesystem::path& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path.string() + ": cannot be read");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("include "))
      read(path.parent_path() / line.substr(8));
    else if (!line.empty() && line[0] != '#')
      script_.push_back(line);
  }
}

void Session::row(const char* who, const std::string& what, std::initializer_list<double> values) {
  trace_ << t_ << ',' << who << ',' << what;
  for (const double v : values) trace_ << ',' << std::defaultfloat << std::setprecision(9) << v;
  trace_ << std::fixed << std::setprecision(4) << '\n';
}

bool Session::every(const char* what, double period) {
  double& last = last_[what];
  if (t_ - last < period) return false;
  last = t_;
  return true;
}

void Session::take(const mavlink::Heartbeat& m) {
  armed_ = m.base_mode & 128;
  mode_ = m.custom_mode;
  heard_ = true;
  row("in", "HEARTBEAT", {double(m.base_mode), double(m.custom_mode), double(m.system_status)});
}

void Session::take(const mavlink::ExtendedSysState& m) {
  if (m.landed_state != landed_) row("in", "EXTENDED_SYS_STATE", {double(m.landed_state)});
  landed_ = m.landed_state;
}

void Session::take(const mavlink::CommandAck& m) {
  acks_[m.command] = m.result;
  if (m.command != 511) row("in", "COMMAND_ACK", {double(m.command), double(m.result), double(m.result_param2)});
}

void Session::take(const mavlink::Statustext& m) {
  std::string text = text_of(m.text);
  std::ranges::replace(text, ',', ';');
  row("in", "STATUSTEXT " + text, {double(m.severity)});
}

void Session::take(const mavlink::ParamValue& m) {
  const double value = o_.px4 && m.param_type != kReal32 ? std::bit_cast<std::int32_t>(m.param_value) : m.param_value;
  parameters_[text_of(m.param_id)] = value;
  row("in", "PARAM_VALUE " + text_of(m.param_id), {value, double(m.param_type)});
}

void Session::take(const mavlink::LocalPositionNed& m) {
  if (every("LOCAL_POSITION_NED", 0.1)) row("in", "LOCAL_POSITION_NED", {m.x, m.y, m.z, m.vx, m.vy, m.vz});
}

void Session::take(const mavlink::EstimatorStatus& m) {
  if (every("ESTIMATOR_STATUS", 0.5))
    row("in", "ESTIMATOR_STATUS", {double(m.flags), m.pos_horiz_ratio, m.pos_vert_ratio, m.vel_ratio});
}

void Session::take(const mavlink::Timesync& m) {
  if (m.tc1 == 0) peer_.send(mavlink::Timesync{now_ns_, m.ts1, kSystem, kFlightController});
}

/// Truth to ODOMETRY, with white noise of the position and five times as much per second of the velocity.
void Session::forward(const Truth& truth) {
  if (!have_truth_) row("note", "first truth", {});
  have_truth_ = true;
  now_ = truth;
  if (every("truth", 0.05))
    row("truth", "p v",
        {truth.p_E.x(), truth.p_E.y(), truth.p_E.z(), truth.v_E.x(), truth.v_E.y(), truth.v_E.z(),
         std::acos(std::clamp((truth.q_EB * Vec3::UnitZ()).z(), -1.0, 1.0))});
  if (!odometry_) return;
  std::normal_distribution<double> normal(0, o_.noise);
  const auto noise = [&] { return Vec3(normal(random_), normal(random_), normal(random_)); };
  const Vec3 p = mavlink::swap_ned(truth.p_E + noise());
  const Vec3 v = mavlink::swap_frd(truth.q_EB.conjugate() * truth.v_E + 5 * noise());
  const Eigen::Quaterniond q = mavlink::swap_ned_frd(truth.q_EB);
  mavlink::Odometry m;
  m.time_usec = static_cast<std::uint64_t>(truth.at_ns / 1000);
  m.x = float(p.x());
  m.y = float(p.y());
  m.z = float(p.z());
  m.q = {float(q.w()), float(q.x()), float(q.y()), float(q.z())};
  m.vx = float(v.x());
  m.vy = float(v.y());
  m.vz = float(v.z());
  m.rollspeed = m.pitchspeed = m.yawspeed = std::numeric_limits<float>::quiet_NaN();
  constexpr std::array<std::size_t, 6> kDiagonal{0, 6, 11, 15, 18, 20};
  for (int i = 0; i < 3; ++i) {
    m.pose_covariance[kDiagonal[i]] = m.velocity_covariance[kDiagonal[i]] = 1e-4F;
    m.pose_covariance[kDiagonal[i + 3]] = m.velocity_covariance[kDiagonal[i + 3]] = 1e-4F;
  }
  m.frame_id = kLocalFrd;
  m.child_frame_id = kBodyFrd;
  m.estimator_type = kVio;
  m.quality = 100;
  peer_.send(m);
}

/// The set-point goes to the target at the script's speed and rests there; 0: at once.
void Session::stream() {
  Vec3 v = Vec3::Zero();
  const Vec3 left = target_ - setpoint_;
  if (speed_ > 0 && left.norm() > speed_ * 0.02) {
    v = speed_ * left.normalized();
    setpoint_ += v * 0.02;
  } else {
    setpoint_ = target_;
  }
  if (!streaming_) return;
  const Vec3 p = mavlink::swap_ned(setpoint_), vn = mavlink::swap_ned(v);
  peer_.send(mavlink::SetPositionTargetLocalNed{.time_boot_ms = std::uint32_t(ms_),
                                                .x = float(p.x()),
                                                .y = float(p.y()),
                                                .z = float(p.z()),
                                                .vx = float(vn.x()),
                                                .vy = float(vn.y()),
                                                .vz = float(vn.z()),
                                                .yaw = float(yaw_),
                                                .type_mask = 2048,
                                                .target_system = kSystem,
                                                .target_component = kFlightController,
                                                .coordinate_frame = kLocalNed});
  if (every("SET_POSITION_TARGET", 0.1))
    row("out", "SET_POSITION_TARGET", {p.x(), p.y(), p.z(), vn.x(), vn.y(), vn.z(), yaw_});
}

double Session::heading_ned() const {
  const Vec3 ahead = mavlink::swap_ned(now_.q_EB * Vec3::UnitX());
  return std::atan2(ahead.y(), ahead.x());
}

}  // namespace backwash::autopilots

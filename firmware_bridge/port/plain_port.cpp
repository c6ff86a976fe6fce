// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/port/plain_port.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "firmware_bridge/autopilots/profile.hpp"
#include "firmware_bridge/mavlink/frames.hpp"

namespace backwash::firmware_bridge {
namespace {

using namespace std::chrono;

// A refused frame of two bytes becomes 21, two states 900: what is read at once always has room.
constexpr std::size_t kRead = 96, kReads = 16;
constexpr std::size_t kNoFrame = 4UL * PLAIN_LARGEST_SIZE;  // bytes without a delimiter: no plain link
constexpr std::uint8_t kOnboardComputer = 191, kController = 1;

// Values of common.xml.
constexpr std::uint8_t kTypeQuadrotor = 2, kCustomModeEnabled = 1, kSafetyArmed = 128, kMavlinkVersion = 3;
constexpr std::uint8_t kStandby = 3, kActive = 4, kCritical = 5, kOnGround = 1, kInAir = 2;
constexpr std::uint16_t kLand = 21, kSetMode = 176, kArm = 400;
constexpr std::uint8_t kAccepted = 0, kDenied = 2;

template <std::size_t N>
Vec3 vec(const float (&v)[N]) noexcept {
  static_assert(N == 3);
  return {v[0], v[1], v[2]};
}

void store(const Vec3& v, float (&into)[3]) noexcept {
  for (int i = 0; i < 3; ++i) into[i] = static_cast<float>(v(i));
}

Eigen::Quaterniond quaternion(const float (&q)[4]) noexcept { return {q[0], q[1], q[2], q[3]}; }

std::uint32_t milliseconds_now() noexcept {
  return static_cast<std::uint32_t>(duration_cast<milliseconds>(steady_clock::now().time_since_epoch()).count());
}

/// 0.1 ms since `time_us` of the monotonic clock.
std::uint16_t age(std::uint64_t time_us) noexcept {
  const auto now = duration_cast<microseconds>(steady_clock::now().time_since_epoch()).count();
  return static_cast<std::uint16_t>(
      std::clamp<std::int64_t>((now - static_cast<std::int64_t>(time_us)) / 100, 0, 65535));
}

/// As the plain frame has it; none: the plain link has no such request.
std::uint8_t request_of(const mavlink::CommandLong& m) noexcept {
  switch (m.command) {
    case kArm:
      return m.param1 == 1 ? PLAIN_REQUEST_ARM : PLAIN_REQUEST_DISARM;
    case kSetMode:
      return m.param2 == static_cast<float>(kPlain.follow) ? PLAIN_REQUEST_FOLLOW : PLAIN_REQUEST_NONE;
    case kLand:
      return PLAIN_REQUEST_LAND;
    default:
      return PLAIN_REQUEST_NONE;
  }
}

}  // namespace

tl::expected<void, PortError> PlainPort::flush() noexcept {
  if (out_begin_ == out_end_) return {};
  const auto taken = line_.write(std::span(out_).subspan(out_begin_, out_end_ - out_begin_));
  if (!taken) return tl::unexpected(taken.error());
  out_begin_ += *taken;
  return {};
}

tl::expected<std::size_t, PortError> PlainPort::write(std::span<const std::uint8_t> bytes) noexcept {
  if (auto sent = flush(); !sent) return tl::unexpected(sent.error());
  if (out_begin_ < out_end_) return 0U;
  out_begin_ = out_end_ = 0;
  parser_.feed(bytes, [this](const mavlink::Frame& frame) { take(frame); });
  if (auto sent = flush(); !sent) return tl::unexpected(sent.error());
  return bytes.size();
}

void PlainPort::discard_output() noexcept {
  out_begin_ = out_end_ = 0;
  line_.discard_output();
}

void PlainPort::take(const mavlink::Frame& frame) noexcept {
  mavlink::decode_and_visit(frame.id, frame.payload, [this]<class Message>(const Message& m) noexcept {
    if constexpr (std::is_same_v<Message, mavlink::Heartbeat>)
      ask(PLAIN_REQUEST_NONE);
    else if constexpr (requires { take(m); })
      take(m);
  });
}

void PlainPort::take(const mavlink::SetPositionTargetLocalNed& m) noexcept {
  plain_command_t command{};
  command.sequence = ++sequence_;
  command.has_setpoint = true;
  command.time_ms = m.time_boot_ms;
  store(mavlink::swap_ned({m.x, m.y, m.z}), command.position);
  store(mavlink::swap_ned({m.vx, m.vy, m.vz}), command.velocity);
  store(mavlink::swap_ned({m.afx, m.afy, m.afz}), command.acceleration);
  command.yaw = static_cast<float>(mavlink::swap_yaw(m.yaw));
  plain_write_command(&command, out_.data());
  out_end_ = PLAIN_COMMAND_SIZE;
}

void PlainPort::take(const mavlink::Odometry& m) noexcept {
  plain_pose_t pose{};
  pose.sequence = ++sequence_;
  pose.reset_counter = m.reset_counter;
  pose.age_tenths_ms = age(m.time_usec);
  pose.time_ms = milliseconds_now();
  store(mavlink::swap_ned({m.x, m.y, m.z}), pose.position);
  const Eigen::Quaterniond q = mavlink::swap_ned_frd({m.q[0], m.q[1], m.q[2], m.q[3]});
  const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
  std::ranges::transform(wxyz, pose.attitude, [](double v) { return static_cast<float>(v); });
  store(mavlink::swap_frd({m.vx, m.vy, m.vz}), pose.velocity_b);
  plain_write_pose(&pose, out_.data());
  out_end_ = PLAIN_POSE_SIZE;
}

void PlainPort::take(const mavlink::CommandLong& m) noexcept {
  const std::uint8_t request = request_of(m);
  if (request == PLAIN_REQUEST_NONE) return;
  ask(request);
  open_ = {sequence_, m.command};
}

void PlainPort::ask(std::uint8_t request) noexcept {
  plain_command_t command{};
  command.sequence = ++sequence_;
  command.request = request;
  command.time_ms = milliseconds_now();
  plain_write_command(&command, out_.data());
  out_end_ = PLAIN_COMMAND_SIZE;
}

tl::expected<std::size_t, PortError> PlainPort::read(std::span<std::uint8_t> into) noexcept {
  const std::size_t room = into.size();
  std::array<std::uint8_t, kRead> bytes;
  for (std::size_t i = 0; i < kReads && into.size() == room; ++i) {
    const auto n = line_.read(bytes);
    if (!n) return tl::unexpected(n.error());
    if (*n == 0) break;
    for (const std::uint8_t byte : std::span(bytes).first(*n)) {
      const plain_event_t event = plain_receive(&receiver_, byte);
      ++since_frame_;
      if (event == PLAIN_NOTHING && since_frame_ < kNoFrame) continue;
      since_frame_ = 0;
      if (event != PLAIN_STATE) {
        tell_refused(into);
        continue;
      }
      plain_state_t state;
      plain_read_state(&receiver_, &state);
      if (std::exchange(last_state_, state.sequence) != state.sequence) tell(state, into);
    }
  }
  return room - into.size();
}

template <class Message>
void PlainPort::tell(const Message& message, std::span<std::uint8_t>& into) noexcept {
  const auto frame = mavlink::encode_frame({system_, kController, mavlink_sequence_++}, message);
  if (frame.length > into.size()) return;
  std::ranges::copy(frame.view(), into.begin());
  into = into.subspan(frame.length);
}

void PlainPort::tell_refused(std::span<std::uint8_t>& into) noexcept {
  const auto before = into;
  tell(mavlink::Heartbeat{}, into);
  if (const std::size_t length = before.size() - into.size(); length > 0) before[length - 1] ^= 0x55;
}

void PlainPort::tell_pose(const plain_state_t& s, std::span<std::uint8_t>& into) noexcept {
  const auto p = mavlink::swap_ned(vec(s.position)).cast<float>().eval();
  const auto v = mavlink::swap_ned(vec(s.velocity)).cast<float>().eval();
  const auto q = mavlink::swap_ned_frd(quaternion(s.attitude)).cast<float>();
  const auto w = mavlink::swap_frd(vec(s.rates)).cast<float>().eval();
  tell(mavlink::LocalPositionNed{s.time_ms, p.x(), p.y(), p.z(), v.x(), v.y(), v.z()}, into);
  tell(mavlink::AttitudeQuaternion{s.time_ms, q.w(), q.x(), q.y(), q.z(), w.x(), w.y(), w.z(), {}}, into);
  // Of ODOMETRY the reset counter counts; the rest says the same as above.
  tell(
      mavlink::Odometry{
          .x = p.x(), .y = p.y(), .z = p.z(), .q = {q.w(), q.x(), q.y(), q.z()}, .reset_counter = s.reset_counter},
      into);
}

void PlainPort::tell(const plain_state_t& s, std::span<std::uint8_t>& into) noexcept {
  tell(mavlink::Heartbeat{.custom_mode = s.following ? kPlain.follow : 0,
                          .type = kTypeQuadrotor,
                          .autopilot = kPlain.number,
                          .base_mode = static_cast<std::uint8_t>(kCustomModeEnabled | (s.armed ? kSafetyArmed : 0)),
                          .system_status = s.failsafe ? kCritical
                                           : s.armed  ? kActive
                                                      : kStandby,
                          .mavlink_version = kMavlinkVersion},
       into);
  if (s.pose_known) tell_pose(s, into);
  if (s.ground_known) tell(mavlink::ExtendedSysState{0, s.on_ground ? kOnGround : kInAir}, into);
  const bool percent_known = s.battery_percent <= 100;
  if (percent_known || s.battery_millivolts > 0) {
    mavlink::BatteryStatus b{.current_battery = -1,
                             .battery_remaining = static_cast<std::int8_t>(percent_known ? s.battery_percent : -1)};
    b.voltages.fill(65535);
    if (s.battery_millivolts > 0) b.voltages[0] = s.battery_millivolts;
    tell(b, into);
  }
  if (open_ && s.answered == open_->sequence && s.answer != PLAIN_ANSWER_NONE) {
    tell(mavlink::CommandAck{.command = open_->command,
                             .result = s.answer == PLAIN_ANSWER_DONE ? kAccepted : kDenied,
                             .target_system = system_,
                             .target_component = kOnboardComputer},
         into);
    open_.reset();
  }
}

}  // namespace backwash::firmware_bridge

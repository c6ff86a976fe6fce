// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <chrono>
#include <optional>
#include <string_view>
#include <variant>

#include "firmware_bridge/clock_filter.hpp"
#include "firmware_bridge/line_budget.hpp"
#include "firmware_bridge/line_loss.hpp"
#include "firmware_bridge/mavlink/signing.hpp"
#include "firmware_bridge/outgoing.hpp"
#include "firmware_bridge/port/plain_port.hpp"
#include "firmware_bridge/port/serial_port.hpp"
#include "firmware_bridge/port/tcp_port.hpp"
#include "firmware_bridge/port/transmit_queue.hpp"
#include "firmware_bridge/port/udp_port.hpp"
#include "firmware_bridge/telemetry.hpp"

namespace backwash::firmware_bridge {

using Port = std::variant<ClosedPort, SerialPort, UdpPort, TcpPort, PlainPort>;

inline constexpr auto kFirstFrameTimeout = std::chrono::seconds(2);     ///< docs/faults.md row 19
inline constexpr int kMaxMissedSetpoints = 2;                           ///< docs/faults.md row 20
inline constexpr auto kTransmitStall = std::chrono::milliseconds(200);  ///< the same, where there are no set-points
inline constexpr std::size_t kTripsOfALine = 4;                         ///< docs/faults.md row 58: 2 s of them
inline constexpr std::uint8_t kOnboardComputer = 191;                   ///< our component id

/// Commands that the link sends (MAV_CMD), to ask telemetry().result_of() for their answers.
inline constexpr std::uint16_t kCommandMessage = 512, kCommandLand = 21, kCommandTakeoff = 22, kCommandSetMode = 176,
                               kCommandArm = 400, kCommandInterval = 511;

/// What is wrong with the link, the gravest first.
enum class LinkFault : std::uint8_t {
  port_lost,            ///< row 17: unplugged; reconnect() with a new port
  nothing_received,     ///< row 19: not one byte within 2 s: cable, or the controller is off
  no_valid_frame,       ///< row 19: bytes, but no frame within 2 s: wrong baud rate or no MAVLink
  none_signed_rightly,  ///< row 29: frames, but none within 2 s whose signature is good: another key, or signing is off
  heartbeat_lost,       ///< row 21: none from the flight controller for 1.5 s
  transmit_stalled,     ///< row 20: transmit_stalled()
};
std::string_view name(LinkFault fault) noexcept;

/// The MAVLink connection to one flight controller. Owned and called by the control thread alone: one thread sends both
/// set-points and heartbeat, so that both stop when it does.
///
/// Nothing is sent before the vehicle's heartbeat is heard, nor of itself: each frame has a caller, but for answers to
/// TIMESYNC. Frames of other systems and components are not acted upon. Every function but the constructor is
/// real-time: non-blocking system calls only, no allocation.
class AutopilotLink {
 public:
  /// `vehicle`: its system id; absent: that of the first flight controller heard. `known`: the autopilots.
  AutopilotLink(Port port, std::optional<std::uint8_t> vehicle, Time now,
                std::span<const AutopilotProfile* const> known = autopilots());

  /// From now on each frame is signed, and a frame without a good signature is not acted upon (row 29). Its time goes
  /// on from `now` by the monotonic clock.
  void require_signatures(const mavlink::Signing& signing, Time now) noexcept;
  /// As it stands; absent: frames are not signed, and signatures are not looked at.
  const std::optional<mavlink::Signing>& signing() const noexcept { return signing_; }

  /// From now on ODOMETRY is thinned to what such a line carries; until then it carries everything.
  void pace(const LineRate& line) noexcept { budget_ = LineBudget(line); }

  /// Takes a newly opened port after a loss and returns the lost one (closing it may wait for the line). All that was
  /// known of the vehicle is forgotten; nothing waits to be sent.
  Port reconnect(Port port, Time now) noexcept;

  /// Reads what has arrived (at most about 8 KiB), then sends what waits. Error: kLost, also on every later call.
  tl::expected<void, PortError> poll(Time now) noexcept;

  const Telemetry& telemetry() const noexcept { return telemetry_; }
  /// The controller's clock, as send_timesync() has measured it within the last kClockUseBy_ms. While it is good to
  /// 5 ms, what telemetry() says has the time at which the controller took it, however old, otherwise that of its
  /// arrival.
  Latest<ClockOffset> clock(Time now) const noexcept { return offset_.at(now); }
  /// ns, of a TIMESYNC question and its answer: the shortest of the last kTripsOfALine, the newest within
  /// kClockUseBy_ms; absent: not so many yet. What waits once for a processor or a radio is no slow line.
  std::optional<std::int64_t> round_trip(Time now) const noexcept;
  /// Of the newest LineLoss::kQuestions; absent: not so many yet, or none is answered.
  std::optional<LineLoss::Shares> loss() const noexcept {
    return loss_.shares(std::holds_alternative<UdpPort>(port_), signing_.has_value());
  }
  /// System id of the vehicle once its heartbeat was heard.
  std::optional<std::uint8_t> vehicle() const noexcept { return heard_; }
  /// Time since the vehicle's last heartbeat; absent: there was none.
  std::optional<Time::duration> heartbeat_age(Time now) const noexcept { return telemetry_.status.age(now); }
  /// The gravest fault now; absent: none, or still within the first two seconds.
  std::optional<LinkFault> fault(Time now) const noexcept;
  /// Called with each frame that was accepted from the line, and each that was handed to the port's queue: for a raw
  /// log. Must itself be real-time. Null: none.
  using Tap = void (*)(void* context, bool outgoing, std::span<const std::uint8_t> frame) noexcept;
  void tap(Tap each, void* context) noexcept {
    tap_ = each;
    tap_context_ = context;
  }
  /// Two set-points in a row did not get out, or the port has taken nothing for 0.2 s of what waits: set-points are not
  /// all that must get out (ArduPilot takes off without).
  bool transmit_stalled(Time now) const noexcept;
  const mavlink::ParserCounters& received() const noexcept { return parser_.counters(); }
  const TransmitQueue& transmit() const noexcept { return queue_; }
  /// untold_delay() of the line that pace() has told, s.
  double untold_delay() const noexcept { return firmware_bridge::untold_delay(budget_.line(), signing_.has_value()); }
  /// ODOMETRY that the line had no room for.
  std::uint64_t thinned() const noexcept { return thinned_; }

  /// Each of these encodes one frame and hands it to the port, or keeps it for poll(). False: refused, because no
  /// vehicle is known, the port is lost, or a value is not finite as the float that it would be on the wire. ODOMETRY
  /// alone holds NaN: where MAVLink has it say "not known", in rates and covariances.
  ///
  /// Set-point in the controller's local frame L, z-up (p_W stands for p_L and so on): position, velocity,
  /// acceleration and yaw; the yaw rate is left to the controller.
  bool send_setpoint(const Setpoint& setpoint_L, Time now) noexcept;
  bool send_heartbeat() noexcept;
  /// As of the last poll(); false also for one that the line has no room for: see pace().
  bool send_odometry(const VioSample& sample) noexcept;
  /// At most 50 characters are sent. Severity as syslog.
  bool send_statustext(std::uint8_t severity, std::string_view text) noexcept;
  bool send_timesync(Time now) noexcept;
  /// COMMAND_LONG to the flight controller.
  bool send_command(std::uint16_t command, const std::array<float, 7>& parameters) noexcept;
  bool send_arm(bool arm) noexcept;
  /// For the mode in which the autopilot follows set-points; false also when it has none, or is silent.
  bool send_follow_setpoints() noexcept;
  /// The autopilot's own take-off (AutopilotProfile::lifts_itself), to a height above where it was armed, m.
  bool send_takeoff(double height) noexcept;
  /// The autopilot's own landing.
  bool send_land() noexcept;
  /// Asks for a message at `rate_hz` > 0.
  bool send_message_interval(std::uint32_t message_id, double rate_hz) noexcept;

  /// Gives the autopilot's local frame a place on the globe, without which ArduPilot has no home and does not arm. Any
  /// place does where there is no GPS: this one is in Zurich.
  bool send_origin() noexcept;

  /// Asks for the parameter of this rule of telemetry().autopilot(); Telemetry::parameters() has the answer. False
  /// also where it has no such rule.
  bool send_parameter_request(std::size_t rule) noexcept;

  /// Forgets what waits to be sent, here and in the kernel: QUIET means that not even an old set-point follows.
  void discard_unsent() noexcept;

 private:
  template <class Message>
  bool send(const Message& message, TransmitQueue::Kind kind = TransmitQueue::Kind::other) noexcept;
  template <class Message>
  bool send_as(std::uint8_t system, const Message& message, TransmitQueue::Kind kind) noexcept;
  void flush() noexcept;
  void take_frame(const mavlink::Frame& frame, Time now) noexcept;
  bool signature_good(const mavlink::Frame& frame, Time now) noexcept;
  void take_timesync(const mavlink::Timesync& m, Time now) noexcept;
  template <class Message>
  Time taken(const Message& m, Time now) const noexcept;
  bool for_us(std::uint8_t system, std::uint8_t component) const noexcept;

  Port port_;
  std::optional<std::uint8_t> configured_vehicle_;
  Time opened_at_;
  std::span<const AutopilotProfile* const> known_;
  std::optional<PortError> lost_;
  mavlink::Parser parser_;
  Telemetry telemetry_;
  TransmitQueue queue_;
  LineBudget budget_;
  Time now_{};  // of the last poll()
  std::uint64_t thinned_ = 0;
  std::optional<Time> blocked_;  // since when the port has taken nothing of what waits
  std::optional<std::uint8_t> heard_;
  ClockFilter clock_;
  LineLoss loss_;
  static constexpr int kClockUseBy_ms = 10'000;  // all that the filter keeps; 0.5 ms at 50 ppm
  Fact<ClockOffset, kClockUseBy_ms> offset_;     // the filter's best
  std::array<std::int64_t, 8> asked_ns_{};       // TIMESYNC questions that have no answer yet, else 0: 4 s of them
  std::size_t questions_ = 0;
  std::uint8_t sequence_ = 0;
  std::optional<mavlink::Signing> signing_;
  mavlink::SigningTime signing_start_ = 0;  // at signing_since_
  Time signing_since_{}, time_told_{};
  bool signed_rightly_ = false;  // a frame since the port was opened
  Tap tap_ = nullptr;
  void* tap_context_ = nullptr;
};

}  // namespace backwash::firmware_bridge

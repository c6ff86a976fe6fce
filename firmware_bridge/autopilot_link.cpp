// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/autopilot_link.hpp"

namespace backwash::firmware_bridge {
namespace {

using namespace std::chrono;

constexpr std::size_t kReadsPerPoll = 64, kBytesPerPoll = 8192;  // a socket gives a datagram a read
constexpr std::size_t kReadSize = PlainPort::kLargestRead;       // more than a datagram: its rest would be lost
constexpr std::uint8_t kFlightController = 1;                    // MAV_COMP_ID_AUTOPILOT1

// Values of common.xml.
constexpr std::uint8_t kTypeOnboardController = 18, kAutopilotInvalid = 8, kStateActive = 4, kMavlinkVersion = 3;
constexpr float kCustomModeEnabled = 1;

std::int64_t nanoseconds_of(Time t) noexcept { return duration_cast<nanoseconds>(t.time_since_epoch()).count(); }
std::uint32_t milliseconds_of(Time t) noexcept {
  return static_cast<std::uint32_t>(duration_cast<milliseconds>(t.time_since_epoch()).count());
}

}  // namespace

std::string_view name(LinkFault fault) noexcept {
  switch (fault) {
    case LinkFault::port_lost:
      return "port lost";
    case LinkFault::nothing_received:
      return "nothing received";
    case LinkFault::no_valid_frame:
      return "no valid frame (wrong baud rate?)";
    case LinkFault::none_signed_rightly:
      return "no frame with a good signature (another key, or not signed?)";
    case LinkFault::heartbeat_lost:
      return "heartbeat lost";
    case LinkFault::transmit_stalled:
      return "transmit stalled";
  }
  return "unknown";
}

AutopilotLink::AutopilotLink(Port port, std::optional<std::uint8_t> vehicle, Time now,
                             std::span<const AutopilotProfile* const> known)
    : port_(std::move(port)), configured_vehicle_(vehicle), opened_at_(now), known_(known), telemetry_(known) {}

Port AutopilotLink::reconnect(Port port, Time now) noexcept {
  std::swap(port_, port);
  opened_at_ = now;
  heard_.reset();
  lost_.reset();
  blocked_.reset();
  parser_ = {};
  telemetry_ = Telemetry(known_);
  queue_.clear();
  budget_.forget();
  clock_ = {};
  offset_ = {};
  loss_ = {};
  asked_ns_ = {};
  signed_rightly_ = false;
  return port;
}

void AutopilotLink::require_signatures(const mavlink::Signing& signing, Time now) noexcept {
  signing_ = signing;
  signing_start_ = signing.time();
  signing_since_ = now;
}

tl::expected<void, PortError> AutopilotLink::poll(Time now) noexcept {
  now_ = now;
  if (signing_) {
    const auto run = duration_cast<microseconds>(now - signing_since_).count() / 10;
    signing_->advance_to(signing_start_ + static_cast<mavlink::SigningTime>(std::max<std::int64_t>(run, 0)));
  }
  std::array<std::uint8_t, kReadSize> bytes;
  std::size_t taken = 0;
  for (std::size_t i = 0; i < kReadsPerPoll && taken < kBytesPerPoll && !lost_; ++i) {
    const auto n = std::visit([&](auto& port) { return port.read(bytes); }, port_);
    if (!n) lost_ = n.error();
    if (!n || *n == 0) break;
    taken += *n;
    parser_.feed(std::span(bytes).first(*n), [&](const mavlink::Frame& frame) { take_frame(frame, now); });
  }
  flush();
  if (lost_) return tl::unexpected(*lost_);
  return {};
}

void AutopilotLink::flush() noexcept {
  if (lost_) return;
  bool took = false;
  const auto done = queue_.flush([&](std::span<const std::uint8_t> bytes) noexcept {
    const auto taken = std::visit([&](auto& port) { return port.write(bytes); }, port_);
    took = took || (taken && *taken > 0);
    return taken;
  });
  if (!done) lost_ = done.error();
  if (took || queue_.waiting() == 0) blocked_.reset();
  if (queue_.waiting() > 0 && !blocked_) blocked_ = now_;
}

void AutopilotLink::discard_unsent() noexcept {
  queue_.clear();
  blocked_.reset();
  budget_.forget();
  std::visit([](auto& port) { port.discard_output(); }, port_);
}

/// An autopilot without a clock of its own signs with an old time until it hears a newer one. As nothing else is sent
/// before it counts as heard, it is asked for the time, once a second: that frame carries ours.
bool AutopilotLink::signature_good(const mavlink::Frame& frame, Time now) noexcept {
  const auto verdict = signing_->judge(frame);
  if (verdict == mavlink::SignatureVerdict::good) return signed_rightly_ = true;
  const bool late = verdict == mavlink::SignatureVerdict::old || verdict == mavlink::SignatureVerdict::replayed;
  const bool from_vehicle = frame.sender.component == kFlightController &&
                            frame.sender.system == configured_vehicle_.value_or(frame.sender.system);
  const auto age = heartbeat_age(now);
  if (late && from_vehicle && !(age && *age < kHeartbeatTimeout) && now - time_told_ >= 1s) {
    time_told_ = now;
    const mavlink::Timesync question{0, nanoseconds_of(now), frame.sender.system, kFlightController};
    send_as(frame.sender.system, question, TransmitQueue::Kind::other);
  }
  return false;
}

void AutopilotLink::take_frame(const mavlink::Frame& frame, Time now) noexcept {
  if (signing_ && !signature_good(frame, now)) return;
  if (tap_) tap_(tap_context_, false, {frame.bytes.data(), frame.bytes.size() + frame.signature.size()});
  if (frame.sender.component != kFlightController) return;
  const auto expected = heard_ ? heard_ : configured_vehicle_;
  if (expected && frame.sender.system != *expected) return;
  loss_.heard(frame.sender.sequence, received().unknown_id);
  if (frame.id == mavlink::Heartbeat::kId) {
    const auto m = mavlink::decode<mavlink::Heartbeat>(frame.payload);
    if (m.autopilot == kAutopilotInvalid) return;
    heard_ = frame.sender.system;
    telemetry_.take(m, now);
    return;
  }
  if (!heard_) return;
  mavlink::decode_and_visit(frame.id, frame.payload, [&]<class Message>(const Message& m) noexcept {
    if constexpr (std::is_same_v<Message, mavlink::Timesync>) {
      take_timesync(m, now);
    } else if constexpr (std::is_same_v<Message, mavlink::CommandAck>) {
      if (for_us(m.target_system, m.target_component)) telemetry_.take(m, now);
    } else if constexpr (requires { telemetry_.take(m, now); }) {
      telemetry_.take(m, taken(m, now));
    }
  });
}

/// When the controller took what it says, by its own stamp, however long ago; now, where it has none, or one of the
/// future. After a restart its stamps count as old until TIMESYNC has found its new clock.
template <class Message>
Time AutopilotLink::taken(const Message& m, Time now) const noexcept {
  if constexpr (requires { m.time_boot_ms; }) {
    constexpr std::int64_t kLongestTrip_ns = 10'000'000, kPerMillisecond = 1'000'000;
    const auto clock = offset_.at(now);
    if (!clock || clock->value.round_trip_ns > kLongestTrip_ns) return now;
    const auto there_ms = static_cast<std::uint32_t>((nanoseconds_of(now) + clock->value.offset_ns) / kPerMillisecond);
    const auto age_ms = static_cast<std::int32_t>(there_ms - m.time_boot_ms);  // its 32 bits wrap after 49 days
    return age_ms > 0 ? now - milliseconds(age_ms) : now;
  }
  return now;
}

/// Older senders name no target: then both ids are 0.
bool AutopilotLink::for_us(std::uint8_t system, std::uint8_t component) const noexcept {
  return (system == 0 || system == heard_) && (component == 0 || component == kOnboardComputer);
}

void AutopilotLink::take_timesync(const mavlink::Timesync& m, Time now) noexcept {
  if (!for_us(m.target_system, m.target_component)) return;
  const std::int64_t now_ns = nanoseconds_of(now);
  if (m.tc1 == 0) {
    send(mavlink::Timesync{now_ns, m.ts1, *heard_, kFlightController});
  } else if (const auto asked = std::ranges::find(asked_ns_, m.ts1); m.ts1 != 0 && asked != asked_ns_.end()) {
    constexpr std::int64_t kSane_ns = std::int64_t{1} << 62;  // 146 years: differences do not overflow
    if (m.tc1 < 0 || m.tc1 > kSane_ns) return;
    *asked = 0;
    loss_.answered();
    const std::int64_t round_trip = now_ns - m.ts1;
    if (round_trip < 0) return;
    if (!offset_.at(now)) clock_ = {};  // the two clocks have drifted since
    clock_.add({m.tc1 - (m.ts1 + round_trip / 2), round_trip});
    offset_.take(*clock_.best(), now);
  }
}

std::optional<std::int64_t> AutopilotLink::round_trip(Time now) const noexcept {
  return offset_.at(now) ? clock_.shortest(kTripsOfALine) : std::nullopt;
}

std::optional<LinkFault> AutopilotLink::fault(Time now) const noexcept {
  if (lost_) return LinkFault::port_lost;
  const auto age = heartbeat_age(now);
  if (!age && now - opened_at_ >= kFirstFrameTimeout) {
    if (received().bytes == 0) return LinkFault::nothing_received;
    if (received().frames == 0) return LinkFault::no_valid_frame;
    return signing_ && !signed_rightly_ ? LinkFault::none_signed_rightly : LinkFault::heartbeat_lost;
  }
  if (age && *age >= kHeartbeatTimeout) return LinkFault::heartbeat_lost;
  if (transmit_stalled(now)) return LinkFault::transmit_stalled;
  return std::nullopt;
}

bool AutopilotLink::transmit_stalled(Time now) const noexcept {
  return queue_.missed_setpoints() >= kMaxMissedSetpoints || (blocked_ && now - *blocked_ >= kTransmitStall);
}

template <class Message>
bool AutopilotLink::send(const Message& message, TransmitQueue::Kind kind) noexcept {
  if (!heard_ || lost_ || !all_finite(message)) return false;
  return send_as(*heard_, message, kind);
}

template <class Message>
bool AutopilotLink::send_as(std::uint8_t system, const Message& message, TransmitQueue::Kind kind) noexcept {
  flush();  // first, so that an older set-point that fits by now is not counted as missed
  const std::uint8_t flags = signing_ ? mavlink::kIncompatSigned : 0;
  mavlink::EncodedFrame frame = mavlink::encode_frame({system, kOnboardComputer, sequence_++}, message, flags);
  if (signing_ && !signing_->sign(frame)) return false;
  if (tap_) tap_(tap_context_, true, frame.view());
  budget_.give(frame.length, kind == TransmitQueue::Kind::odometry, now_);
  queue_.push(frame, kind);
  flush();
  return !lost_;
}

bool AutopilotLink::send_setpoint(const Setpoint& setpoint_L, Time now) noexcept {
  return send(setpoint_message(setpoint_L, milliseconds_of(now), {heard_.value_or(0), kFlightController}),
              TransmitQueue::Kind::setpoint);
}

bool AutopilotLink::send_heartbeat() noexcept {
  return send(mavlink::Heartbeat{.type = kTypeOnboardController,
                                 .autopilot = kAutopilotInvalid,
                                 .system_status = kStateActive,
                                 .mavlink_version = kMavlinkVersion});
}

bool AutopilotLink::send_odometry(const VioSample& sample) noexcept {
  if (!all_finite(sample)) return false;
  if (!budget_.carries_odometry(now_)) {
    ++thinned_;
    return false;
  }
  return send(odometry_message(sample), TransmitQueue::Kind::odometry);
}

bool AutopilotLink::send_statustext(std::uint8_t severity, std::string_view text) noexcept {
  mavlink::Statustext m{.severity = severity};
  std::ranges::copy(text.substr(0, m.text.size()), m.text.begin());
  return send(m);
}

bool AutopilotLink::send_parameter_request(std::size_t rule) noexcept {
  if (rule >= telemetry_.autopilot().rules.size()) return false;
  const std::string_view name = telemetry_.ask(rule);
  mavlink::ParamRequestRead m{
      .param_index = -1, .target_system = heard_.value_or(0), .target_component = kFlightController, .param_id = {}};
  std::ranges::copy(name.substr(0, m.param_id.size()), m.param_id.begin());
  return send(m);
}

bool AutopilotLink::send_timesync(Time now) noexcept {
  const std::int64_t now_ns = nanoseconds_of(now);
  if (!send(mavlink::Timesync{0, now_ns, heard_.value_or(0), kFlightController})) return false;
  asked_ns_[questions_++ % asked_ns_.size()] = now_ns;
  if (const auto age = heartbeat_age(now); age && *age < kHeartbeatTimeout) loss_.asked();
  return true;
}

bool AutopilotLink::send_command(std::uint16_t command, const std::array<float, 7>& p) noexcept {
  return send(mavlink::CommandLong{p[0], p[1], p[2], p[3], p[4], p[5], p[6], command, heard_.value_or(0),
                                   kFlightController, 0});
}

bool AutopilotLink::send_arm(bool arm) noexcept { return send_command(kCommandArm, {arm ? 1.0F : 0.0F}); }

bool AutopilotLink::send_follow_setpoints() noexcept {
  const auto status = telemetry_.status.at(now_);
  if (!status || !status->value.autopilot->follows) return false;
  return send_command(kCommandSetMode, {kCustomModeEnabled, static_cast<float>(status->value.autopilot->follow)});
}

bool AutopilotLink::send_takeoff(double height) noexcept {
  return send_command(kCommandTakeoff, {0, 0, 0, 0, 0, 0, static_cast<float>(height)});
}

bool AutopilotLink::send_land() noexcept { return send_command(kCommandLand, {}); }

bool AutopilotLink::send_origin() noexcept {
  constexpr std::int32_t kLatitude = 473'977'000, kLongitude = 85'456'000, kAltitude = 488'000;  // 1e-7 deg, mm
  return send(mavlink::SetGpsGlobalOrigin{kLatitude, kLongitude, kAltitude, heard_.value_or(0), 0});
}

bool AutopilotLink::send_message_interval(std::uint32_t message_id, double rate_hz) noexcept {
  if (!(rate_hz > 0)) return false;
  return send_command(kCommandInterval, {static_cast<float>(message_id), static_cast<float>(1e6 / rate_hz)});
}

}  // namespace backwash::firmware_bridge

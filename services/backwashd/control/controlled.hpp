// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/adapt/in_flight.hpp"
#include "core/sync/atomic_optional.hpp"
#include "core/sync/handover.hpp"
#include "core/sync/latest_value.hpp"
#include "core/sync/record_ring.hpp"
#include "core/track/flight_tick.hpp"
#include "firmware_bridge/autopilot_link.hpp"
#include "firmware_bridge/gpio/stop_switch.hpp"
#include "firmware_bridge/parameters.hpp"
#include "services/backwashd/control/timing.hpp"
#include "services/backwashd/record/control_record.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

inline constexpr std::uint64_t kTicksPerSecond = 50;

/// Factors of the air for the map worker. One falls only with a rising number of falls: resets, and calmer air at rest.
struct HandedAir {
  AirFactors factors = kModelledAir;
  std::uint64_t falls = 0;
};

/// What the flight has learnt of its air, by class.
struct AirView {
  bool frozen = false;             ///< the factors stay as they are
  AirClass here = AirClass::none;  ///< of the newest place that was flown through
  AirFactors factors = kModelledAir;
  std::array<double, kAirClasses> ln_evidence{}, seconds{};  ///< core/adapt/bets.hpp
  std::array<adapt::Cause, kAirClasses> causes{};            ///< of factors above 1
};

/// What the control thread shows to the others, once a tick.
struct ControlView {
  std::int64_t t_ns = 0;
  Mode mode = Mode::passive;
  Reason reason = Reason::started;
  bool armed = false, offboard = false;                                      ///< as in track::AutopilotFacts
  std::optional<bool> landed;                                                ///< as in track::TickOutput
  std::optional<firmware_bridge::ClockOffset> clock;                         ///< the autopilot's
  static constexpr double kNever = std::numeric_limits<double>::infinity();  ///< an age before the first, s
  double odometry_age = kNever, heartbeat_age = kNever, pose_age = kNever;   ///< s; pose: the autopilot's
  double odometry_lost_after = OdometryTiming::kHoldAfter;                   ///< age that is not flown by any more, s
  State state;                                                               ///< newest good odometry
  Setpoint command;                                                          ///< sent or held this tick, map frame
  track::Epoch epoch;                 ///< what is planned under another one is refused
  std::uint64_t segment = 0;          ///< accepted segment, 0 before the first
  std::uint64_t index = 0;            ///< of its next command
  bool finished = true;               ///< the segment's commands are all sent
  bool braking = false;               ///< on a verified stop of the segment
  std::uint64_t stop_branch = 0;      ///< of that stop
  std::uint32_t closures = 0;         ///< loop closures seen: the map frame of state and command
  track::RigidShift shift;            ///< from the segment's frame into that one
  std::uint64_t refused_segment = 0;  ///< the last one refused
  std::uint64_t ticks = 0;
  dds::Status shown{};                 ///< what no thread decides by, as it is sent: counts, residual of the heading
  double residual_m = 0;               ///< of the frames
  Mismatch mismatch = Mismatch::none;  ///< of the frames: then enabling is refused
  firmware_bridge::SwitchState stop_switch = firmware_bridge::SwitchState::absent;
  const firmware_bridge::AutopilotProfile* autopilot = &firmware_bridge::kUnknownAutopilot;
  std::optional<firmware_bridge::FirmwareVersion> version;  ///< of the autopilot's firmware
  firmware_bridge::ParameterValues parameters{};            ///< of the autopilot's rules
  std::optional<bool> estimator_follows, would_arm;         ///< as the autopilot says of itself, while it says it
  double untold_delay = 0;                                  ///< of the autopilot's line, s
  std::optional<double> round_trip;  ///< of a question on that line, the shortest of the last four, s
  std::optional<firmware_bridge::LineLoss::Shares> loss;  ///< shares lost of its frames, of ours, of ODOMETRY
  /// Its newest line of a warning or graver, and when it came: why it does not do what it is asked.
  firmware_bridge::Latest<firmware_bridge::StatusLine> warning;
  firmware_bridge::Latest<firmware_bridge::Battery> battery;  ///< the autopilot's, while it says it
  std::optional<AirView> air;                                 ///< none: nothing is learnt in flight
  TimingHistogram tick, lateness, odometry_to_wire;
};

/// What the control thread has to tell the operator; rarer than ticks, and none is skipped while the ring has room.
struct ControlEvent {
  enum class Kind : std::uint8_t {
    transition,
    missed_deadline,
    page_fault,
    rougher,
    calmer,
    air_kept,
    battery_silent
  } kind = Kind::transition;
  std::int64_t t_ns = 0;
  Mode mode = Mode::passive;
  Reason reason = Reason::started;
  std::uint64_t count = 0;             ///< periods missed, pages faulted
  AirClass air = AirClass::none;       ///< whose factor changed
  double factor = 1, ln_evidence = 0;  ///< to what, and on what
  adapt::Cause cause = adapt::Cause::none;
};

/// A port that was opened again. The control thread swaps its lost one in, so that closing it is not its work.
struct FreshPort {
  mutable firmware_bridge::Port port;
};

/// A sign of life of the control thread, for the strobe and the status LED.
struct Pulse {
  std::atomic<std::uint64_t> ticks{0};
  std::atomic<firmware_bridge::Signal> signal{firmware_bridge::Signal::idle};
};

/// Written by the control thread, and by the link watch beside it.
struct Controlled {
  sync::LatestValue<ControlView> view_mission, view_planner, view_status;  // control → each
  sync::LatestValue<HandedAir> air;        // control → map worker: each time that a factor changed
  sync::LatestValue<AirFactors> air_kept;  // control → air file: the same
  sync::LatestValue<Vec3> vehicle_W;       // control → map worker: where the newest good odometry is, in the map
  sync::RecordRing<ControlRecord, 2048> control_log;                  // control → recorder
  sync::RecordRing<ControlEvent, 256> events;                         // control → link watch
  sync::Handover<FreshPort> ports;                                    // link watch → control
  std::atomic<std::optional<firmware_bridge::LinkFault>> link_fault;  // control → link watch
  static_assert(decltype(link_fault)::is_always_lock_free);
  std::atomic<std::uint32_t> port_losses{0};  // control → link watch: times that a good port was lost
  sync::AtomicOptional<mavlink::SigningTime, 0> signing_time;  // control → signing time: of the newest signature
  Pulse pulse;                                                 // control → gpio
};

}  // namespace backwash::daemon

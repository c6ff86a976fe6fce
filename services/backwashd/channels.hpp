// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/adapt/in_flight.hpp"
#include "core/log/raw/raw_log.hpp"
#include "core/plan/world/world.hpp"
#include "core/sync/atomic_optional.hpp"
#include "core/sync/handover.hpp"
#include "core/sync/latest_value.hpp"
#include "core/sync/record_ring.hpp"
#include "core/track/flight_tick.hpp"
#include "core/types/time.hpp"
#include "firmware_bridge/autopilot_link.hpp"
#include "firmware_bridge/gpio/stop_switch.hpp"
#include "firmware_bridge/parameters.hpp"
#include "services/backwashd/control/timing.hpp"
#include "services/backwashd/map/map_news.hpp"
#include "services/dds/topics.hpp"

/// What the daemon's threads hand to each other. Every member has exactly one writing and one reading thread and is
/// wait-free; the picture is in services/backwashd/README.md.
namespace backwash::daemon {

/// CLOCK_MONOTONIC, ns.
inline std::int64_t now_ns() noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

using track::OdometrySample;

/// The surroundings as they were seen.
struct Snapshot {
  std::shared_ptr<const plan::World> world;
  std::int64_t seen_ns = 0;  ///< reception of the newest data in it
};

/// The newest snapshot, to each thread that looks at it. Freed by the map worker alone.
struct Worlds {
  sync::Handover<Snapshot> mission, planner, reader, control;

  void offer(const Snapshot& newest) {
    for (auto* to : {&mission, &planner, &reader, &control}) to->offer(std::make_unique<const Snapshot>(newest));
  }
  void collect() {
    for (auto* to : {&mission, &planner, &reader, &control}) to->collect();
  }
};

/// One line for the operator.
using Line = std::array<char, 192>;

/// What became of a map that came in parts.
struct MapVerdict {
  std::uint64_t transfer = 0;
  bool accepted = false;
  Line why{};  ///< it was not
};

/// One command as received, or the news that a writer of commands is gone. Of the station's name only printable
/// characters are left, and as many as fit.
struct CommandMessage {
  WriterId writer{};      ///< another one at each start of a process
  bool departed = false;  ///< no command: this writer is gone, and with it its session; nothing else here is set
  std::array<char, 64> station{};
  std::uint64_t session = 0;
  std::uint32_t sequence = 0;
  std::uint8_t verb = 0;
  Vec3 position = Vec3::Zero();
  double yaw = 0;
  static constexpr std::size_t kMostWaypoints = 64;
  std::size_t waypoints = 0;  ///< of follow; more than kMostWaypoints: as many were sent, and none is kept
  std::array<std::array<double, 3>, kMostWaypoints> waypoint{};
};

/// Which command of which session.
struct CommandId {
  std::uint64_t session = 0;
  std::uint32_t sequence = 0;
};

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

/// One record of a real-time thread for the raw log.
struct ControlRecord {
  log::RecordHeader header{};
  std::array<std::uint8_t, 512> bytes{};
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

/// What the mission asks the planner for. It plans in the newest world.
struct PlanJob {
  enum class Kind { takeoff, go_to, brake } kind = Kind::takeoff;
  std::uint64_t id = 0;
  Vec3 position = Vec3::Zero();  ///< goal; take-off: z counts
  std::optional<double> yaw;     ///< heading at the goal, rad; none: as the path leads there
  track::Epoch epoch;            ///< that it was asked for in: it is not done in another
};

/// How a job ended.
struct PlanOutcome {
  std::uint64_t job = 0;
  bool ok = false;
  std::array<char, 160> reason{};  ///< one line when not ok
};

/// What the stop switch says, and when it was looked at last: a thread that hangs in its driver says nothing new.
struct SwitchReading {
  std::atomic<firmware_bridge::SwitchState> state{firmware_bridge::SwitchState::absent};
  std::atomic<std::int64_t> at_ns{0};
};

inline constexpr std::size_t kVoxelRecords = 8;

/// A sign of life of the control thread, for the strobe and the status LED.
struct Pulse {
  std::atomic<std::uint64_t> ticks{0};
  std::atomic<firmware_bridge::Signal> signal{firmware_bridge::Signal::idle};
};

/// When something was done, CLOCK_MONOTONIC, ns; none: not yet.
using AtomicTime = sync::AtomicOptional<std::int64_t, INT64_MIN>;

struct Channels {
  sync::LatestValue<OdometrySample> odometry;          // DDS reader → control
  sync::RecordRing<OdometrySample, 512> poses;         // DDS reader → map reader
  sync::LatestValue<track::RigidShift> map_from_odom;  // DDS reader → map reader: the newest loop closure
  sync::LatestValue<Line> refused, refused_map;        // DDS reader, map reader → status: the newest, and why
  sync::RecordRing<CommandMessage, 64> commands;       // DDS reader → mission
  sync::Handover<MapMessage> maps;                     // map reader → map worker
  sync::LatestValue<MapVerdict> map_verdict;           // map worker → map reader: of the last that came in parts
  sync::LatestValue<MapWriter> map_writer;             // map worker → map reader: of the first good map of a term
  sync::RecordRing<Scan*, 16> scans;                   // map reader → map worker, which frees them
  sync::RecordRing<WindowCloud*, 16> windows;          // map reader → map worker, which frees them
  Worlds worlds;                                       // map worker → each
  /// Map reader, map worker → control, which takes what finds no room to be everywhere.
  sync::RecordRing<NewVoxels, kVoxelRecords> scan_voxels, map_voxels;
  AtomicTime map_ns;                                 // map worker: reception of the newest data in the snapshot
  std::atomic<std::uint64_t> blocked_segment{0};     // planner → control: not clear in the newest world
  std::atomic<std::uint64_t> rough_segment{0};       // the same, in the air as the flight has learnt it
  sync::LatestValue<HandedAir> air;                  // control → map worker: each time that a factor changed
  sync::LatestValue<AirFactors> air_kept;            // control → air file: the same
  sync::RecordRing<adapt::AirOrder, 16> air_orders;  // mission → control
  sync::RecordRing<track::Order, 64> orders;         // mission → control
  sync::Handover<PlanJob> jobs;                      // mission → planner
  sync::RecordRing<PlanOutcome, 16> outcomes;        // planner → mission
  sync::Handover<track::AcceptedSegment> segments;   // planner → control
  sync::LatestValue<ControlView> view_mission, view_planner, view_status;  // control → each
  std::atomic<bool> world_moves{false};  // map worker → planner: the newest world goes along with a mapper's window
  std::atomic<bool> map_partial{false};  // map worker → planner: the newest world is what is around the vehicle alone
  sync::LatestValue<Vec3> vehicle_W;     // control → map worker: where the newest good odometry is, in the map
  sync::RecordRing<ControlRecord, 2048> control_log;                  // control → recorder
  sync::RecordRing<ControlRecord, 256> command_log;                   // DDS reader → recorder
  sync::RecordRing<ControlEvent, 256> events;                         // control → link watch
  sync::Handover<FreshPort> ports;                                    // link watch → control
  std::atomic<std::optional<firmware_bridge::LinkFault>> link_fault;  // control → link watch
  static_assert(decltype(link_fault)::is_always_lock_free);
  std::atomic<std::uint32_t> port_losses{0};  // control → link watch: times that a good port was lost
  sync::AtomicOptional<mavlink::SigningTime, 0> signing_time;  // control → signing time: of the newest signature
  sync::LatestValue<Line> odometry_doubt;          // DDS reader → mission: "", or why it is not what we were told
  sync::LatestValue<Line> other_daemon;            // DDS reader → mission: "", or who else obeys our commands
  sync::LatestValue<std::array<char, 192>> place;  // mission → status: what keeps it from flying from here
  AtomicTime enable_asked_ns;                      // mission → control: when an operator last asked to enable
  sync::LatestValue<CommandId> accepted;           // mission → status: the newest command that was
  sync::LatestValue<std::array<char, 192>> task;   // mission → status: of the last command
  std::atomic<std::uint64_t> maps_accepted{0}, maps_rejected{0}, commands_refused{0};
  std::atomic<std::uint64_t> scans_accepted{0}, scans_rejected{0}, odometry_refused{0}, loop_closures{0},
      closures_refused{0}, foreign_writers{0};
  SwitchReading stop_switch;  // gpio → control
  Pulse pulse;                // control → gpio
  std::atomic<bool> stop{false};

  /// s since the newest data in the map was received; nothing: there is no map. Real-time: wait-free.
  std::optional<double> map_age(std::int64_t now_ns) const noexcept {
    const std::optional<std::int64_t> received_ns = map_ns.load();
    return received_ns ? std::optional(seconds(now_ns - *received_ns)) : std::nullopt;
  }
  /// Records of real-time threads that the raw log had no room for.
  std::uint64_t records_lost() const noexcept { return control_log.lost() + command_log.lost(); }
};

}  // namespace backwash::daemon

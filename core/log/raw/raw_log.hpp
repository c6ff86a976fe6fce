// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/types/air_class.hpp"
#include "core/types/geometry.hpp"

namespace backwash::log {

/// The daemon's raw log: every input and output in the order in which the daemon saw it. A file is MCAP
/// (core/log/mcap/mcap_flight.hpp): its channel kRawTopic holds the records, each RecordHeader and `size` bytes,
/// little-endian, as a std_msgs/msg/UInt8MultiArray.
inline constexpr char kRawTopic[] = "/backwash/raw_log";

/// A file of before version 0.1.0: this line, then the records without padding. Version 0.1 still reads it.
inline constexpr char kRawLogMagic[] = "backwash raw log 3\n";

enum class RecordKind : std::uint32_t {
  configuration = 1,  ///< text: the vehicle, model and daemon files as given
  odometry = 2,       ///< OdometryRecord
  map = 3,            ///< MapRecord, then the octomap data, or RejectedMap
  command = 4,        ///< text, one line
  ack = 5,            ///< text, one line
  frame_in = 6,       ///< one MAVLink frame received
  frame_out = 7,      ///< one MAVLink frame handed to the port
  tick = 8,           ///< TickRecord
  segment = 9,      ///< SegmentRecord, then 10 doubles (p, v, a, yaw) for the command before it and for each of its own
  constants = 10,   ///< ConstantsRecord, and what was added to it
  tick_input = 11,  ///< TickInputRecord: what the next tick record was decided from
  offer = 12,       ///< OfferRecord …: a segment as it was offered to the control thread (core/log/raw/tick_log.hpp)
  lost = 13,        ///< LostRecord: the disk did not take what came before
  scan = 14,        ///< text, one line: a scan was handed to the control thread and to the map worker
  world = 15,       ///< text, one line: a new snapshot was handed out
  failure = 16,     ///< text, one line: an exception in a thread, which ended the daemon
  part = 17,        ///< PartRecord: the first of each file
  air_constants = 18,  ///< AirConstantsRecord: the daemon learns in flight (core/log/raw/air_log.hpp)
  air = 19,            ///< AirRecord: what the tick whose record follows added to what was learnt
  air_order = 20,      ///< AirOrderRecord: what an operator asked of that, before the same tick's air
};
inline constexpr auto kLastKind = RecordKind::air_order;

struct RecordHeader {
  std::int64_t t_ns;  ///< CLOCK_MONOTONIC when the daemon saw it
  RecordKind kind;
  std::uint32_t size;  ///< bytes that follow
};
static_assert(sizeof(RecordHeader) == 16);

struct OdometryRecord {
  std::int64_t stamp_ns;  ///< the sender's stamp
  double p[3], v[3];      ///< m, m/s, map frame
  double q[4];            ///< body to map: w, x, y, z
};

struct MapRecord {
  double resolution;     ///< m
  std::uint32_t binary;  ///< octomap_msgs/Octomap.binary
  std::uint32_t accepted;
};

/// In place of the data of a map that was not accepted.
struct RejectedMap {
  std::uint64_t bytes;  ///< that the map had
  std::uint64_t hash;   ///< of them: 64-bit FNV-1a
};

struct SegmentRecord {
  std::uint64_t id, continues, commands;
  double start_p[3], start_v[3];  ///< state from which the tube was propagated, map frame
  double search_ms, optimise_ms, verify_ms;
};

/// One control tick.
struct TickRecord {
  std::uint64_t tick;
  std::uint64_t segment, index;  ///< accepted segment and the command of it that this tick sent; 0 before the first
  std::uint32_t mode, reason;    ///< Mode, Reason
  std::uint32_t sent;            ///< bit 0: set-point, bit 1: heartbeat, bit 2: odometry forwarded
  std::uint32_t judged, inside;  ///< whether the error was judged this tick, and the verdict
  std::uint32_t missed_periods;
  float compute_us, lateness_us;  ///< of the tick before this one
  float odometry_to_wire_us;      ///< from the reception of a sample to the set-point that first used it; < 0: none new
  float frame_residual_m, frame_residual_rad;
  std::uint32_t page_faults;                             ///< of the control thread since start
  double p[3], v[3];                                     ///< newest odometry, map frame
  double cmd_p[3], cmd_v[3], cmd_a[3], cmd_yaw;          ///< command in the map frame
  double center[3], half_widths[kDirections];            ///< set predicted for this tick, m
  double local_p[3], local_v[3], local_a[3], local_yaw;  ///< command in the controller's frame
  std::uint32_t asked;                                   ///< what was to be sent, bits as in Asked
  std::uint32_t padding;
};
static_assert(sizeof(TickRecord) == 352);

/// What the decisions of a flight depend on beside their inputs (core/track/flight_tick.hpp).
struct ConstantsRecord {
  double v_max, estimation_position, initial_position, initial_velocity, battery_land;
};
/// In its place where the odometry's timing is not the usual one (OdometryTiming).
struct TimedConstantsRecord {
  ConstantsRecord constants;
  double rate_least, latency;  ///< Hz, s
};
/// In its place since a pose is held against its twist by a law that the log says (track::DriftLaw); before, it was
/// track::kDriftOverASecond.
struct DriftConstantsRecord {
  TimedConstantsRecord timed;
  double ends, deviations, scale, lag, over[3];
};
static_assert(sizeof(DriftConstantsRecord) == 112);

/// What the updates of the air depend on beside their ticks (core/adapt/in_flight.hpp).
struct AirConstantsRecord {
  double kp[2], kd[2];  ///< horizontal, vertical
  double latency, feedback_delay, attitude_lag;
  double tau_low, tau_high, mean[2], alpha;
  double start[kAirClasses];
};
/// The same where sets may shrink; without it none does.
struct CalmAirConstantsRecord {
  AirConstantsRecord constants;
  double calmest;
};
struct AirRecord {
  std::uint64_t tick;
  double sigma[3];            ///< of the model at the place, (m/s²)²
  std::uint32_t air, frozen;  ///< AirClass of the place; whether the factors stay as they are
  double factors[kAirClasses];
  double ln_evidence, ln_changed, seconds;  ///< of that class (core/adapt/bets.hpp)
};
static_assert(sizeof(AirRecord) == 104);
struct AirOrderRecord {
  std::uint64_t tick;
  std::uint32_t order, done;    ///< adapt::AirOrder; not done: it came too late
  double factors[kAirClasses];  ///< after it
};
static_assert(sizeof(AirOrderRecord) == 56);

struct LostRecord {
  std::uint64_t records;  ///< lost since the start of the log
};

/// Which file this is of those that one start of the daemon wrote.
struct PartRecord {
  std::int64_t log;        ///< the same in all of them: CLOCK_REALTIME at the start, ns
  std::int64_t wall_ns;    ///< CLOCK_REALTIME less CLOCK_MONOTONIC when this file was begun
  std::uint32_t part;      ///< 1, 2, 3 …
  std::uint32_t repeated;  ///< records behind this one that an earlier part holds: what a flight cannot be read without
};
static_assert(sizeof(PartRecord) == 24);

/// track::TickInput, flat.
struct TickInputRecord {
  std::int64_t now_ns, odometry_received_ns, odometry_stamp_ns, pose_at_ns, attitude_at_ns;
  std::uint64_t segment;                                  ///< id of the segment offered, 0: none
  std::uint64_t order;                                    ///< number of the newest order, 0: none new
  double p[3], v[3], q[4];                                ///< odometry
  double pose_p[3], pose_v[3], pose_q[4], pose_omega[3];  ///< the autopilot's
  double heartbeat_age, battery;
  double map_from_odom[4];  ///< yaw and translation of the newest loop closure
  std::int32_t missed_periods;
  std::uint32_t request, flags, reset_counter;  ///< flags: core/log/raw/tick_log.cpp
  std::uint32_t closures;
  float position_sigma;  ///< m; 0: not known
};
static_assert(sizeof(TickInputRecord) == 312);
/// In its place since decisions rest on what the odometry says of its velocity.
struct StatedTickInputRecord {
  TickInputRecord input;
  double velocity_variance[3];  ///< (m/s)², body; zeros: it does not say
};
static_assert(sizeof(StatedTickInputRecord) == 336);

/// A record as read back.
struct RawRecord {
  RecordHeader header;
  std::vector<std::uint8_t> bytes;
  std::uint64_t offset = 0;  ///< of its header in the file that was read
};

struct RawLog {
  std::vector<RawRecord> records;
  /// Offset of a last record (0: of the first line) that a crash cut short; it is not in `records`.
  std::optional<std::uint64_t> cut_at;
};

/// The record that these bytes begin with. Nothing: they begin with none, or with part of one.
std::optional<RawRecord> raw_record(std::span<const std::uint8_t> bytes);

/// Reads a raw log, whatever its name: its first bytes say what it is. Errors: not_found; bad_data with the byte
/// offset.
tl::expected<RawLog, LogError> read_raw_log(const std::string& path);

/// Reads the parts of one log, in their order, as one: what a later part repeats of an earlier one is left out. Errors:
/// those of read_raw_log; bad_data naming a file that is not the part that comes next, or that is cut short before one.
tl::expected<RawLog, LogError> read_raw_logs(std::span<const std::string> paths);

/// Which part a file is, by its first record: reads its beginning alone. Nothing: it does not say, or is no raw log.
std::optional<PartRecord> part_of(const std::string& path);

/// Which part a log ends with. Nothing: it is of a daemon that wrote no parts.
std::optional<PartRecord> last_part(const RawLog& log);

/// The payload as T, or nothing if it is shorter.
template <typename T>
const T* payload(const RawRecord& record) {
  return record.bytes.size() >= sizeof(T) ? reinterpret_cast<const T*>(record.bytes.data()) : nullptr;
}

}  // namespace backwash::log

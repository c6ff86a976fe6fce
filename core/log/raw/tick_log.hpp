// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <span>

#include "core/log/raw/raw_log.hpp"
#include "core/track/flight_tick.hpp"

/// The control tick in the raw log: what went in, what came out, and the same again from the log alone.
namespace backwash::log {

/// Bits of TickRecord::asked.
enum Asked : std::uint32_t {
  kAskedSetpoint = 1u << 0,
  kAskedHeartbeat = 1u << 1,  ///< the mode allows it; it is sent once a second
  kAskedOdometry = 1u << 2,
  kAskedOffboard = 1u << 3,
  kAskedLand = 1u << 4,
  kAskedArm = 1u << 5,
  kAskedDisarm = 1u << 6,
  kAskedTakeoff = 1u << 7,
};

/// Real-time: wait-free, no allocation.
StatedTickInputRecord encode(const track::TickInput& in) noexcept;
/// The same input again, bit for bit, but for the segment, which is the caller's. Of a record as they were before, its
/// odometry says nothing of its velocity.
track::TickInput decode(const TickInputRecord& record, const track::AcceptedSegment* segment) noexcept;
track::TickInput decode(const StatedTickInputRecord& record, const track::AcceptedSegment* segment) noexcept;

/// Writes what was decided into the record; times, counters and what was really sent are left as they are. Real-time:
/// wait-free, no allocation.
void decided(const track::FlightTick& flight, const track::TickOutput& out, TickRecord& record) noexcept;

DriftConstantsRecord constants(const Vehicle& vehicle, double battery_land, const OdometryTiming& timing,
                               const track::DriftLaw& law = {}) noexcept;

/// A segment with its sets and stops as bytes of an `offer` record, and back. Error: bad_data if sizes disagree.
std::vector<std::uint8_t> encode(const track::AcceptedSegment& segment);
tl::expected<std::unique_ptr<track::AcceptedSegment>, LogError> decode_offer(std::span<const std::uint8_t> bytes);

/// Where a replay first decides otherwise than the log says.
struct Difference {
  std::uint64_t tick = 0;
  std::uint64_t offset = 0;  ///< byte of the tick's record in the log
  std::string field;         ///< name of the TickRecord's member
  double logged = 0, replayed = 0;
};

struct Replay {
  std::uint64_t ticks = 0, segments = 0, differing = 0;
  std::uint64_t setpoints = 0;      ///< ticks that asked for a set-point
  std::uint64_t ticks_missing = 0;  ///< numbers that the log skips: records that the daemon could not write
  std::uint64_t state_hash = 0;     ///< FNV-1a over all replayed decisions: equal for equal replays
  std::optional<Difference> first;
  std::string stopped;  ///< why the last ticks of a log that ends in flight are not replayed; empty: all are
};

/// Runs the logged inputs through track::FlightTick again and compares every decision bit for bit. Errors: bad_data
/// with the byte offset: a part of a log that is not its first, no constants, an input without its tick, an offered
/// segment that is not in the log. Offers come by another ring than ticks: what the last second offers may lie beyond
/// the end of a log that a kill ended, and then ends the replay.
tl::expected<Replay, LogError> replay(const RawLog& log, const std::string& name);

}  // namespace backwash::log

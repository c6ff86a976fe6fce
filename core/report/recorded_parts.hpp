// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/log/raw/raw_log.hpp"
#include "core/types/state.hpp"

namespace backwash::report {

/// A trajectory as the daemon took it on.
struct RecordedSegment {
  log::SegmentRecord head;
  Setpoint previous;               ///< the command before its first one
  std::vector<Setpoint> commands;  ///< one a control period, W
};

/// Those of a log, in their order.
std::vector<RecordedSegment> recorded_segments(std::span<const log::RawRecord> log);
/// Whether a trajectory rises on one line.
bool vertical(const RecordedSegment& segment);
/// CLOCK_MONOTONIC of a log's first tick; without one of its first record, of an empty log 0.
std::int64_t first_tick_ns(std::span<const log::RawRecord> log);

/// What a log tells of its air, record by record.
class AirNews {
 public:
  /// Factors that grew, and a flight that was stopped for them: a line each.
  std::vector<std::string> take(const log::RawRecord& record);

 private:
  AirFactors factors_ = kModelledAir;
};

/// The bench's log of the truth by time.
class TruthRows {
 public:
  /// `log` has two rows or more with rising stamps, and outlives this.
  explicit TruthRows(const log::FlightLog& log) : log_(log) {}
  /// The columns x, y, z at t (s, the log's clock), linear in between; beyond its ends by up to 0.1 s the nearest row,
  /// farther away nothing.
  std::optional<Vec3> at(double t, const char* x, const char* y, const char* z) const;

 private:
  const log::FlightLog& log_;
};

}  // namespace backwash::report

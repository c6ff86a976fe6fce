// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/log/flight_log.hpp"
#include "core/log/raw_log.hpp"
#include "core/types/state.hpp"

namespace backwash::report {

/// A trajectory as the daemon took it on.
struct RecordedSegment {
  log::SegmentRecord head;
  Setpoint previous;               ///< the command before its first one
  std::vector<Setpoint> commands;  ///< one a control period, W
};

/// Nothing: the record is of another kind, or too short for the head.
std::optional<RecordedSegment> recorded_segment(const log::RawRecord& record);

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
  /// The columns x, y, z at t (s, the log's clock), linear in between; beyond its ends the nearest row.
  Vec3 at(double t, const char* x, const char* y, const char* z) const;

 private:
  const log::FlightLog& log_;
};

}  // namespace backwash::report

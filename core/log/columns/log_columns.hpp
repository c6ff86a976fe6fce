// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/types/geometry.hpp"

namespace backwash::log {

/// Whether a log has all these columns.
inline bool has_all(const FlightLog& log, std::span<const char* const> names) {
  return std::ranges::all_of(names, [&](const char* name) { return log.has(name); });
}
/// Whether a log has the three columns of a vector: has_xyz(log, "cmd_v", "_mps") asks for cmd_vx_mps and so on.
inline bool has_xyz(const FlightLog& log, const std::string& prefix, const std::string& unit) {
  return log.has(prefix + "x" + unit) && log.has(prefix + "y" + unit) && log.has(prefix + "z" + unit);
}

/// That vector in a row. Precondition: has_xyz.
inline Vec3 xyz(const FlightLog& log, const std::string& prefix, const std::string& unit, std::size_t row) {
  return {log.column(prefix + "x" + unit)[row], log.column(prefix + "y" + unit)[row],
          log.column(prefix + "z" + unit)[row]};
}

/// Takes the gaps (NaN) out of a log: a column of which half the rows and more are gaps is left out, and then each row
/// with a gap in a column that a log may hold (mappable_columns()) or in t_s. What was left out, a sentence each.
std::vector<std::string> leave_out_gaps(FlightLog& log);

}  // namespace backwash::log

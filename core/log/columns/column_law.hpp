// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/types/geometry.hpp"

namespace backwash::log {

/// Correlation from which one quantity follows another, half of its variance, and below which they are strangers.
inline constexpr double kFollows = 0.7, kStranger = 0.3;

/// How a quantity y goes with another, x, when both are measured with errors (docs/model.md, 3-9): y = sign·g·x, g
/// within [low, high]. Frisch's bounds (1934), each moved outwards by its sampling error.
struct Gain {
  int sign = 0;                  ///< 0: the data do not say
  double low = 0, high = 0;      ///< of |g|; `high` is infinite where y says nothing of x
  double correlation = 0;        ///< of the two, −1 … 1
  double correlation_error = 0;  ///< its sampling error times as many as the bounds are moved by
  bool within(double least, double most) const { return low <= most && high >= least; }
};

/// Gain of y by x, means taken off both. Sampling errors: jackknife over ten successive parts, Student's t at 99 %.
/// Precondition: as many of each. Fewer than 20, or one that does not vary: sign 0. O(n).
Gain gain_of(std::span<const double> x, std::span<const double> y);

/// What of a log contradicts the rest of it.
struct ColumnDoubt {
  std::vector<std::string> columns;  ///< to be left out
  std::string words;                 ///< the columns, the figures, and what would be right
  /// The log as a whole is in doubt: nothing of this kind agrees, and one unit, sign or axis explains all of it.
  bool whole = false;
};

/// Columns of a vector that ought to follow those of another.
struct ColumnPair {
  std::vector<std::string> said, wanted;  ///< names by axis; how they are called in words
  std::string of_what;                    ///< "the derivative"
  double least = 0;      ///< rms that says nothing yet, and by which a sane logger may be off, in the unit of both
  double sane_most = 0;  ///< a sane logger's gain is within [1/sane_most, sane_most]
  bool units = false;    ///< whether a unit of `said` or `wanted` may explain a gain
  std::vector<std::string> leave_out = {};  ///< in place of the one that is wrong
};

/// Judges axis by axis: what hardly moves, or hardly differs, says nothing; an axis is told if its gain excludes all
/// that a sane logger gives, if it follows another axis or the opposite of its own, or if two that move have nothing to
/// do with each other. `said`, `shown`: rows of both. Without doubts: empty.
std::vector<ColumnDoubt> doubts_of(const ColumnPair& pair, std::span<const Vec3> said, std::span<const Vec3> shown);

/// Half the way, as a factor, from a column's own unit to the nearest one that it may be mistaken for: √1.944 (knots)
/// of a velocity. Derived from units_of() of the column and of what it is derived from.
double nearest_unit(const std::string& column, const std::string& derived_from);

}  // namespace backwash::log

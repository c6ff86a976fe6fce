// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "core/log/raw/raw_log.hpp"

namespace backwash::log {

/// One exchange of TIMESYNC that we asked for.
struct ClockPair {
  std::int64_t ours_ns;        ///< CLOCK_MONOTONIC, half way between question and answer
  std::int64_t theirs_ns;      ///< the autopilot's since its start, as it answered
  std::int64_t round_trip_ns;  ///< the pair is good to half of it
};

/// The autopilot's answers in a raw log, of its last start alone: where its clock falls, it began anew.
std::vector<ClockPair> clock_pairs(const RawLog& log);

/// Two clocks as a straight line: ours = ours₀ + (1 + rate) · (theirs − theirs₀).
struct ClockLine {
  std::int64_t ours_ns = 0, theirs_ns = 0;  ///< a point of it
  double rate = 0;                          ///< of ours against theirs, less 1
  double rms_s = 0, largest_s = 0;          ///< what is left of the pairs that it was laid through
  double round_trip_s = 0;                  ///< longest of theirs: no pair is better known than half of it
  std::size_t pairs = 0;                    ///< so many
  std::int64_t ours(double theirs_s) const noexcept;
};

/// The line through pairs by least squares: of each 5 s the one with the shortest round trip, because what lengthens a
/// round trip waits on one of its ways and falsifies the pair. Below 10 s the clocks' rates are taken to be equal.
/// Precondition: one pair or more.
ClockLine clock_line(const std::vector<ClockPair>& pairs);

}  // namespace backwash::log

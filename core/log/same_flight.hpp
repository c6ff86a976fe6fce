// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <unordered_set>

#include "core/log/flight_log.hpp"

namespace backwash::log {

/// The positions of a flight, to find it again under another name, cut short or with other stamps: no two flights
/// measure the same position to the last bit again and again.
class FlightMark {
 public:
  explicit FlightMark(const FlightLog& log);
  /// Share of the fewer positions that both flights hold, 0 … 1. Of a flight and another one it is next to 0, of a
  /// flight and a part of it 1. A position that repeats counts once; below 50 of them nothing is said (0).
  double shared(const FlightMark& other) const;

 private:
  std::unordered_set<std::size_t> positions_;  // hashes
};

/// From this share on two logs are told as one flight: half of the shorter one.
inline constexpr double kSameFlight = 0.5;

}  // namespace backwash::log

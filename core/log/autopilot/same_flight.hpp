// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "core/log/columns/flight_log.hpp"

namespace backwash::log {

/// The positions of a flight, to find it again under another name, cut short or with other stamps: no two flights
/// measure the same position to the last bit again and again.
class FlightMark {
 public:
  explicit FlightMark(const FlightLog& log);
  /// Share of the fewer positions that both flights hold, 0 … 1. Of a flight and another one it is next to 0, of a
  /// flight and a part of it 1. A position that repeats counts once; below 50 of them nothing is said (0).
  double shared(const FlightMark& other) const;

  /// A mark from what another one holds; rising.
  explicit FlightMark(std::vector<std::size_t> positions) : positions_(std::move(positions)) {}
  const std::vector<std::size_t>& positions() const noexcept { return positions_; }

 private:
  std::vector<std::size_t> positions_;  // hashes, rising, each once
};

/// From this share on two logs are told as one flight: half of the shorter one.
inline constexpr double kSameFlight = 0.5;

/// Of each flight the first one before it that is the same flight and no other's, or its own number: what comparing
/// each with all before it finds, in time that grows with the flights and with what they share.
std::vector<std::size_t> same_flights(const std::vector<FlightMark>& marks);

/// Flights that one call was given so far.
class KnownFlights {
 public:
  /// Why a flight is one of them under another name, a sentence; empty: it is new, and one of them from now on.
  std::string again(const std::string& name, FlightMark mark);

 private:
  std::vector<std::pair<std::string, FlightMark>> known_;
};

}  // namespace backwash::log

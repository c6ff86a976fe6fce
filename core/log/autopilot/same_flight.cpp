// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/autopilot/same_flight.hpp"

#include <algorithm>
#include <functional>
#include <string_view>

namespace backwash::log {
namespace {

constexpr std::size_t kLeast = 50;

}  // namespace

FlightMark::FlightMark(const FlightLog& log) {
  if (!log.has("x_m") || !log.has("y_m") || !log.has("z_m")) return;
  for (std::size_t row = 0; row < log.t_s.size(); ++row) {
    const double p[] = {log.column("x_m")[row], log.column("y_m")[row], log.column("z_m")[row]};
    positions_.push_back(std::hash<std::string_view>{}({reinterpret_cast<const char*>(p), sizeof p}));
  }
  std::ranges::sort(positions_);
  positions_.erase(std::unique(positions_.begin(), positions_.end()), positions_.end());
}

double FlightMark::shared(const FlightMark& other) const {
  const std::size_t fewer = std::min(positions_.size(), other.positions_.size());
  if (fewer < kLeast) return 0;
  std::size_t both = 0;
  for (auto a = positions_.begin(), b = other.positions_.begin();
       a != positions_.end() && b != other.positions_.end();) {
    both += *a == *b ? 1 : 0;
    *a < *b ? ++a : *b < *a ? ++b : (++a, ++b);
  }
  return static_cast<double>(both) / static_cast<double>(fewer);
}

std::string KnownFlights::again(const std::string& name, FlightMark mark) {
  for (const auto& [known, other] : known_)
    if (const double shared = mark.shared(other); shared >= kSameFlight)
      return name + ":1: " + std::to_string(static_cast<int>(100 * shared)) + " % of the positions are those of " +
             known + ": the same flight under two names";
  known_.emplace_back(name, std::move(mark));
  return {};
}

std::vector<std::size_t> same_flights(const std::vector<FlightMark>& marks) {
  std::vector<std::pair<std::size_t, std::size_t>> places;  // hash, flight
  for (std::size_t f = 0; f < marks.size(); ++f)
    for (const std::size_t hash : marks[f].positions()) places.emplace_back(hash, f);
  std::ranges::sort(places);
  // Places that several flights hold are few: those of each flight, and where its list of flights begins.
  std::vector<std::vector<std::size_t>> common(marks.size());
  for (std::size_t k = 0, end = 0; k < places.size(); k = end) {
    for (end = k + 1; end < places.size() && places[end].first == places[k].first;) ++end;
    for (std::size_t i = k; i < end && end - k > 1; ++i) common[places[i].second].push_back(k);
  }
  std::vector<std::size_t> same(marks.size()), both(marks.size());
  for (std::size_t f = 0; f < marks.size(); ++f) {
    std::ranges::fill(both, std::size_t{0});
    for (const std::size_t k : common[f])
      for (std::size_t i = k; places[i].second != f; ++i) ++both[places[i].second];
    same[f] = f;
    for (std::size_t g = 0; g < f && !common[f].empty() && same[f] == f; ++g) {
      const std::size_t fewer = std::min(marks[f].positions().size(), marks[g].positions().size());
      if (same[g] == g && fewer >= kLeast && static_cast<double>(both[g]) / static_cast<double>(fewer) >= kSameFlight)
        same[f] = g;
    }
  }
  return same;
}

}  // namespace backwash::log

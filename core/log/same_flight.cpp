// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/same_flight.hpp"

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
    positions_.insert(std::hash<std::string_view>{}({reinterpret_cast<const char*>(p), sizeof p}));
  }
}

double FlightMark::shared(const FlightMark& other) const {
  const bool ours = positions_.size() <= other.positions_.size();
  const auto &fewer = ours ? positions_ : other.positions_, &more = ours ? other.positions_ : positions_;
  if (fewer.size() < kLeast) return 0;
  const auto both = std::ranges::count_if(fewer, [&](std::size_t p) { return more.contains(p); });
  return static_cast<double>(both) / static_cast<double>(fewer.size());
}

}  // namespace backwash::log

// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/clock_filter.hpp"

#include <algorithm>
#include <cstdlib>
#include <span>

namespace backwash::firmware_bridge {

std::optional<ClockOffset> ClockFilter::best() const noexcept {
  if (count_ == 0) return std::nullopt;
  return *std::ranges::min_element(std::span(kept_).first(count_), {}, &ClockOffset::round_trip_ns);
}

std::optional<std::int64_t> ClockFilter::shortest(std::size_t exchanges) const noexcept {
  if (exchanges == 0 || count_ < exchanges) return std::nullopt;
  std::int64_t least = INT64_MAX;
  for (std::size_t back = 1; back <= exchanges; ++back)
    least = std::min(least, kept_[(next_ + kKept - back) % kKept].round_trip_ns);
  return least;
}

void ClockFilter::add(const ClockOffset& exchange) noexcept {
  if (const auto believed = best()) {
    const std::int64_t errors = (believed->round_trip_ns + exchange.round_trip_ns) / 2;
    if (std::abs(exchange.offset_ns - believed->offset_ns) > errors + kDrift_ns) count_ = next_ = 0;
  }
  kept_[next_] = exchange;
  next_ = (next_ + 1) % kKept;
  count_ = std::min(count_ + 1, kKept);
}

}  // namespace backwash::firmware_bridge

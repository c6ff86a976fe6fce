// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdio>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/types/time.hpp"
#include "services/dds/guard/fragments.hpp"

namespace backwash::daemon {

/// Tells the operator of large samples, as a whole map on `map`, that do not become whole: the middleware tells
/// nobody. Pure: it has no clock of its own.
class PartialWatch {
 public:
  static constexpr std::int64_t kLong_ns = 10'000'000'000;   ///< on its way, or without a new fragment
  static constexpr std::int64_t kAgain_ns = 60'000'000'000;  ///< between two lines of one that is still on its way

  /// A line for each of these samples of which there is something to tell now.
  std::vector<std::string> look(std::span<const dds::Partial> samples, std::int64_t now_ns) {
    std::erase_if(told_, [&](const Told& t) {
      return std::ranges::none_of(samples, [&](const auto& s) { return s.writer == t.writer && s.number == t.number; });
    });
    std::vector<std::string> lines;
    for (const dds::Partial& sample : samples)
      if (auto line = line_of(sample, now_ns)) lines.push_back(std::move(*line));
    return lines;
  }

 private:
  struct Told {
    dds::Guid writer{};
    std::uint64_t number = 0;
    std::int64_t next_ns = 0;
    bool ended = false;  // that it does not go on
  };

  std::optional<std::string> line_of(const dds::Partial& sample, std::int64_t now_ns) {
    auto told = std::ranges::find_if(
        told_, [&](const Told& t) { return t.writer == sample.writer && t.number == sample.number; });
    if (told == told_.end())
      told = told_.insert(told, {sample.writer, sample.number, sample.begun_ns + kLong_ns, false});
    const bool silent = now_ns - sample.newest_ns >= kLong_ns;
    told->ended = told->ended && silent;
    if (silent ? told->ended : now_ns < told->next_ns) return std::nullopt;
    told->ended = silent;
    told->next_ns = now_ns + kAgain_ns;
    char line[128];
    std::snprintf(line, sizeof line, " (%.1f MiB): %.0f %% came in %.0f s",
                  static_cast<double>(sample.size) / (1 << 20), 100.0 * sample.came / sample.count,
                  seconds(sample.newest_ns - sample.begun_ns));
    return "a sample of writer " + dds::text(sample.writer) + line +
           (silent ? ", then nothing; over a bad line use backwashctl map" : "; over a bad line use backwashctl map");
  }

  std::vector<Told> told_;
};

}  // namespace backwash::daemon

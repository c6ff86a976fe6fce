// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <optional>
#include <string>

#include "core/types/time.hpp"
#include "services/dds/fragments.hpp"

namespace backwash::daemon {

/// Tells the operator of a large sample, as a whole map on `map`, that does not become whole: the middleware tells
/// nobody. Pure: it has no clock of its own.
class PartialWatch {
 public:
  static constexpr std::int64_t kLong_ns = 10'000'000'000;   ///< on its way, or without a new fragment
  static constexpr std::int64_t kAgain_ns = 60'000'000'000;  ///< between two lines of one that is still on its way

  /// One line if there is something to tell of this sample now.
  std::optional<std::string> look(const std::optional<dds::Partial>& sample, std::int64_t now_ns) {
    if (!sample) return std::nullopt;
    if (sample->writer != writer_ || sample->number != number_) {
      writer_ = sample->writer;
      number_ = sample->number;
      next_ns_ = sample->begun_ns + kLong_ns;
      ended_ = false;
    }
    const bool silent = now_ns - sample->newest_ns >= kLong_ns;
    ended_ = ended_ && silent;
    if (silent ? ended_ : now_ns < next_ns_) return std::nullopt;
    ended_ = silent;
    next_ns_ = now_ns + kAgain_ns;
    char line[128];
    std::snprintf(line, sizeof line, " (%.1f MiB): %.0f %% came in %.0f s",
                  static_cast<double>(sample->size) / (1 << 20), 100.0 * sample->came / sample->count,
                  seconds(sample->newest_ns - sample->begun_ns));
    return "a sample of writer " + dds::text(sample->writer) + line +
           (silent ? ", then nothing; over a bad line use backwashctl map" : "; over a bad line use backwashctl map");
  }

 private:
  dds::Guid writer_{};
  std::uint64_t number_ = 0;
  std::int64_t next_ns_ = 0;
  bool ended_ = false;  // that it does not go on was told
};

}  // namespace backwash::daemon

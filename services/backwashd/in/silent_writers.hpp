// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "services/dds/dds.hpp"

namespace backwash::daemon {

/// Tells the operator of a writer of whole maps that is there while no map of it comes: what can be told where
/// fragments are encrypted (PartialWatch sees none then). Each is told once. Pure: it has no clock of its own.
class SilentWriters {
 public:
  static constexpr std::int64_t kLong_ns = 10'000'000'000;

  /// A sample of this writer has come whole.
  void heard(const dds::Guid& writer) { known_[writer].done = true; }
  /// A line for each of the writers that are there now and have been for so long without a sample.
  std::vector<std::string> look(std::span<const dds::Guid> there, std::int64_t now_ns) {
    std::erase_if(known_, [&](const auto& k) { return std::ranges::find(there, k.first) == there.end(); });
    std::vector<std::string> lines;
    for (const dds::Guid& writer : there) {
      Known& known = known_.try_emplace(writer, Known{now_ns}).first->second;
      if (known.done || now_ns - known.since_ns < kLong_ns) continue;
      known.done = true;
      lines.push_back(
          "writer " + dds::text(writer) +
          " of maps: no map of it came whole in 10 s; it sent none, or over a bad line use backwashctl map");
    }
    return lines;
  }

 private:
  struct Known {
    std::int64_t since_ns = 0;
    bool done = false;  // heard, or told of
  };
  std::map<dds::Guid, Known> known_;
};

}  // namespace backwash::daemon

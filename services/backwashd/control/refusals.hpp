// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <map>
#include <string>

#include "core/sync/latest_value.hpp"
#include "services/backwashd/clock.hpp"
#include "services/backwashd/text.hpp"

namespace backwash::daemon {

/// What one reading thread refuses: counted, and said at most once a second for each counter, so that a flood costs a
/// count and hides no other cause. Used by that thread alone.
class Refusals {
 public:
  /// `newest`: what was said last, for the status.
  explicit Refusals(sync::LatestValue<Line>& newest) : newest_(newest) {}

  /// `why` makes one line, and is called only if that is said.
  template <typename Why>
  void add(std::atomic<std::uint64_t>& counter, Why&& why) {
    ++counter;
    if (Said& said = said_[&counter]; now_ns() < said.next_ns)
      ++said.left_out;
    else
      say(said, why());
  }

 private:
  struct Said {
    std::int64_t next_ns = 0;
    std::uint64_t left_out = 0;
  };
  void say(Said& said, const std::string& why);

  sync::LatestValue<Line>& newest_;
  std::map<const void*, Said> said_;
};

}  // namespace backwash::daemon

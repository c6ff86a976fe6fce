// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/control/refusals.hpp"

#include <spdlog/spdlog.h>

#include <cstdio>
#include <utility>

namespace backwash::daemon {

void Refusals::say(Said& said, const std::string& why) {
  constexpr std::int64_t kPause_ns = 1'000'000'000;
  const auto left_out = std::exchange(said.left_out, 0);
  said.next_ns = now_ns() + kPause_ns;
  if (left_out > 0)
    spdlog::warn("refused: {} ({} more since the last such line)", why, left_out);
  else
    spdlog::warn("refused: {}", why);
  Line line{};
  std::snprintf(line.data(), line.size(), "%s", why.c_str());
  newest_.write(line);
}

}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

namespace backwash::daemon {

/// How much one sender is listened to: kBurst of its samples at once, then one every kPrice_ns (generic cell rate).
class Allowance {
 public:
  static constexpr std::int64_t kPrice_ns = 20'000'000;  ///< a control period: more orders could not be carried out
  static constexpr std::int64_t kBurst = 20;

  /// Whether a sample that came now (monotonic, ns) is within it; then it is counted.
  bool take(std::int64_t now_ns) noexcept {
    const std::int64_t next = std::max(paid_ns_.value_or(now_ns), now_ns) + kPrice_ns;
    if (next - now_ns > kBurst * kPrice_ns) return false;
    paid_ns_ = next;
    return true;
  }

 private:
  std::optional<std::int64_t> paid_ns_;
};

}  // namespace backwash::daemon

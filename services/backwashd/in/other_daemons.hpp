// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "services/dds/dds.hpp"

namespace backwash::daemon {

/// Who else obeys the commands of our name space: another writer of its status (docs/faults.md row 52). Pure: the
/// caller passes the time in.
class OtherDaemons {
 public:
  /// Two that start together find each other within this time, ns; until then neither is alone.
  static constexpr std::int64_t kDiscovery_ns = 1'000'000'000;

  explicit OtherDaemons(std::int64_t started_ns) noexcept : started_ns_(started_ns) {}
  /// `other`: the writer that the middleware knows now. Returns why nothing may be enabled ("": nothing forbids it), if
  /// that has changed; at the first call always.
  std::optional<std::string> look(const std::optional<dds::Guid>& other, std::int64_t now_ns) {
    std::string why;
    if (other)
      why = "another daemon in this namespace, writer " + dds::text(*other);
    else if (now_ns - started_ns_ < kDiscovery_ns)
      why = "no second has passed since the start: another daemon in this namespace would not be known";
    if (told_ == why) return std::nullopt;
    told_ = why;
    return why;
  }

 private:
  std::int64_t started_ns_;
  std::optional<std::string> told_;
};

}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "services/dds/dds.hpp"

namespace backwash::daemon {

/// The one writer of a topic that is listened to: the first whose sample was good, until it is gone (docs/faults.md row
/// 48). Pure: it has no clock of its own.
class BoundWriter {
 public:
  /// `what` it writes, for people.
  explicit BoundWriter(std::string what) : what_(std::move(what)) {}

  const std::optional<dds::Guid>& writer() const noexcept { return writer_; }
  /// Whether a sample of this writer is judged at all; otherwise refusal() says why not.
  bool hears(const dds::Guid& writer) const noexcept { return !writer_ || *writer_ == writer; }
  std::string refusal(const dds::Guid& writer) const {
    return what_ + " of writer " + dds::text(writer) + ": that of " + dds::text(*writer_) +
           (!gone_ns_ ? " is in use"
            : stays_  ? ", which is gone, was flown with: disable first"
                      : ", which is gone, is let go in a moment");
  }
  /// A sample of this writer was good. True if nobody was listened to before. Precondition: hears(writer).
  bool bind(const dds::Guid& writer) noexcept { return !std::exchange(writer_, writer); }
  /// Those are gone. True once the bound one has been for 0.5 s and `replaceable` says that another may take its place:
  /// by then an enabling that it began has ended. Nobody is bound from then on.
  bool let_go(std::span<const dds::Guid> departed, bool replaceable, std::int64_t now_ns) noexcept {
    constexpr std::int64_t kForget_ns = 500'000'000;
    if (writer_ && !gone_ns_ && std::ranges::find(departed, *writer_) != departed.end()) gone_ns_ = now_ns;
    stays_ = !replaceable;
    if (!gone_ns_ || !replaceable || now_ns - *gone_ns_ < kForget_ns) return false;
    writer_.reset();
    gone_ns_.reset();
    return true;
  }

 private:
  std::string what_;
  std::optional<dds::Guid> writer_;
  std::optional<std::int64_t> gone_ns_;  // since when it is gone
  bool stays_ = false;                   // nobody may take its place now
};

}  // namespace backwash::daemon

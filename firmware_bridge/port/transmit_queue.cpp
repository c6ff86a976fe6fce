// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/port/transmit_queue.hpp"

#include <algorithm>

namespace backwash::firmware_bridge {

void TransmitQueue::push(const mavlink::EncodedFrame& frame, Kind kind) noexcept {
  const std::size_t first_whole = head_written_ > 0 ? 1 : 0;
  bool missed = false;
  for (std::size_t i = count_; i-- > 0 && kind != Kind::other;) {
    const bool older = frames_[i].kind == kind;
    missed = missed || (older && kind == Kind::setpoint);
    if (i < first_whole || (!older && frames_[i].kind != Kind::odometry)) continue;
    remove(i);
    ++dropped_;
  }
  if (missed) ++missed_setpoints_;
  if (count_ == kCapacity) {
    if (frames_[first_whole].kind == Kind::setpoint) ++missed_setpoints_;
    remove(first_whole);
    ++dropped_;
  }
  frames_[count_++] = {frame, kind};
}

void TransmitQueue::finish_head() noexcept {
  if (frames_[0].kind == Kind::setpoint) missed_setpoints_ = 0;
  remove(0);
  head_written_ = 0;
  ++sent_;
}

void TransmitQueue::remove(std::size_t index) noexcept {
  std::move(frames_.begin() + static_cast<std::ptrdiff_t>(index) + 1,
            frames_.begin() + static_cast<std::ptrdiff_t>(count_),
            frames_.begin() + static_cast<std::ptrdiff_t>(index));
  --count_;
}

void TransmitQueue::clear() noexcept {
  count_ = 0;
  head_written_ = 0;
  missed_setpoints_ = 0;
}

}  // namespace backwash::firmware_bridge

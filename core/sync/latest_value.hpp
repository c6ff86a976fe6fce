// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <type_traits>

namespace backwash::sync {

/// Newest value from one writer to one reader: a triple buffer. Older unread values are overwritten.
/// Both operations are wait-free and never allocate; exactly one thread may write and exactly one may read.
template <typename T>
class LatestValue {
  static_assert(std::is_trivially_destructible_v<T>, "a value that owns memory would be freed on a real-time thread");
  static_assert(std::atomic<std::uint8_t>::is_always_lock_free);

 public:
  /// Real-time: wait-free, no allocation.
  void write(const T& value) noexcept {
    slots_[back_] = value;
    back_ = shared_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel) & kIndex;
  }
  /// The newest value if one was written since the last call, else nothing. Real-time: wait-free, no allocation.
  std::optional<T> read_new() noexcept {
    if (!(shared_.load(std::memory_order_relaxed) & kFresh)) return std::nullopt;
    front_ = shared_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    return slots_[front_];
  }

 private:
  static constexpr std::uint8_t kIndex = 3, kFresh = 4;
  std::array<T, 3> slots_{};
  alignas(64) std::uint8_t back_ = 0;
  alignas(64) std::atomic<std::uint8_t> shared_{1};
  alignas(64) std::uint8_t front_ = 2;
};

}  // namespace backwash::sync

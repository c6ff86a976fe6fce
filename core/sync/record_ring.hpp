// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

namespace backwash::sync {

/// First-in first-out ring from one writer to one reader; what does not fit is refused and counted, never waited for.
/// Both operations are wait-free and never allocate; exactly one thread may push and exactly one may pop.
template <typename T, std::size_t kCapacity>
class RecordRing {
  static_assert(std::is_trivially_destructible_v<T>, "a record that owns memory would be freed on a real-time thread");
  static_assert((kCapacity & (kCapacity - 1)) == 0, "capacity is a power of two");
  static_assert(std::atomic<std::size_t>::is_always_lock_free);

 public:
  /// False, and counted, if the ring is full. Real-time: wait-free, no allocation.
  [[nodiscard]] bool push(const T& record) noexcept {
    if (room() == 0) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    records_[tail % kCapacity] = record;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }
  /// As push(), of what may be lost: whoever reads lost() tells how much was. Real-time: wait-free, no allocation.
  void push_or_count(const T& record) noexcept { static_cast<void>(push(record)); }
  /// The oldest record, or nothing. Real-time: wait-free, no allocation.
  std::optional<T> pop() noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return std::nullopt;
    const T record = records_[head % kCapacity];
    head_.store(head + 1, std::memory_order_release);
    return record;
  }
  /// How many records push() would take now; writer's thread only. Real-time: wait-free, no allocation.
  std::size_t room() const noexcept {
    return kCapacity - (tail_.load(std::memory_order_relaxed) - head_.load(std::memory_order_acquire));
  }
  /// Records refused so far.
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

 private:
  std::array<T, kCapacity> records_{};
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
  std::atomic<std::uint64_t> lost_{0};
};

}  // namespace backwash::sync

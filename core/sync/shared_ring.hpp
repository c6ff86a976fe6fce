// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

namespace backwash::sync {

/// First-in first-out ring from any number of writers to one reader; what does not fit is refused and counted, never
/// waited for. push() is lock-free: a writer that is preempted in the middle of it holds up what the reader gets, no
/// other writer. After Vyukov's bounded queue: each cell's number says whose turn it is.
template <typename T, std::size_t kCapacity>
class SharedRing {
  static_assert(std::is_trivially_copyable_v<T>, "a record is copied where a real-time thread may run");
  static_assert((kCapacity & (kCapacity - 1)) == 0, "capacity is a power of two");
  static_assert(std::atomic<std::size_t>::is_always_lock_free);

 public:
  SharedRing() {
    for (std::size_t n = 0; n < kCapacity; ++n) cells_[n].turn.store(n, std::memory_order_relaxed);
  }
  /// False, and counted, if the ring is full. Real-time: lock-free, no allocation.
  [[nodiscard]] bool push(const T& record) noexcept {
    std::size_t at = tail_.load(std::memory_order_relaxed);
    for (;;) {
      const auto ahead = static_cast<std::ptrdiff_t>(cells_[at % kCapacity].turn.load(std::memory_order_acquire) - at);
      if (ahead < 0) {
        lost_.fetch_add(1, std::memory_order_relaxed);
        return false;
      }
      if (ahead > 0)
        at = tail_.load(std::memory_order_relaxed);
      else if (tail_.compare_exchange_weak(at, at + 1, std::memory_order_relaxed))
        break;
    }
    Cell& cell = cells_[at % kCapacity];
    cell.record = record;
    cell.turn.store(at + 1, std::memory_order_release);
    return true;
  }
  /// As push(), of what may be lost: whoever reads lost() tells how much was. Real-time: lock-free, no allocation.
  void push_or_count(const T& record) noexcept { static_cast<void>(push(record)); }
  /// The oldest record, or nothing. One thread only. Real-time: wait-free, no allocation.
  std::optional<T> pop() noexcept {
    Cell& cell = cells_[head_ % kCapacity];
    if (cell.turn.load(std::memory_order_acquire) != head_ + 1) return std::nullopt;
    const T record = cell.record;
    cell.turn.store(head_ + kCapacity, std::memory_order_release);
    ++head_;
    return record;
  }
  /// Records refused so far.
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

 private:
  struct Cell {
    std::atomic<std::size_t> turn{0};  ///< position to write at; one more: to read
    T record{};
  };
  std::array<Cell, kCapacity> cells_;
  alignas(64) std::atomic<std::size_t> tail_{0};
  alignas(64) std::size_t head_ = 0;  // the reader's
  std::atomic<std::uint64_t> lost_{0};
};

}  // namespace backwash::sync

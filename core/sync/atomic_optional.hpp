// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <optional>

namespace backwash::sync {

/// A number or none, none at first: any thread may store and load. `kNone` stands for none inside of it, and is no
/// number to be stored. It orders no other memory: a number for itself, not the news that something else is ready.
template <typename T, T kNone>
class AtomicOptional {
  static_assert(std::atomic<T>::is_always_lock_free);

 public:
  /// Precondition: value ≠ kNone. Real-time: wait-free, no allocation.
  void store(T value) noexcept { value_.store(value, std::memory_order_relaxed); }
  /// Real-time: wait-free, no allocation.
  std::optional<T> load() const noexcept {
    const T value = value_.load(std::memory_order_relaxed);
    return value == kNone ? std::nullopt : std::optional(value);
  }

 private:
  std::atomic<T> value_{kNone};
};

}  // namespace backwash::sync

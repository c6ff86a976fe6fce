// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <memory>

#include "core/sync/record_ring.hpp"

namespace backwash::sync {

/// Newest immutable object from one writer to one real-time reader, for objects that own memory. The writer allocates
/// and frees; the reader only moves pointers: what it has finished with goes back through a ring and is freed by the
/// writer. Exactly one thread may write and exactly one may read.
template <typename T>
class Handover {
 public:
  Handover() = default;
  Handover(const Handover&) = delete;
  Handover& operator=(const Handover&) = delete;
  /// Precondition: writer and reader have stopped. Frees all but what the reader took and did not give back.
  ~Handover() {
    delete offered_.load();
    collect();
  }

  /// Offers an object in place of any that was not yet taken, which is returned, and frees what the reader gave back.
  /// Not real-time.
  std::unique_ptr<const T> offer(std::unique_ptr<const T> object) {
    collect();
    return std::unique_ptr<const T>(offered_.exchange(object.release(), std::memory_order_acq_rel));
  }
  /// Frees what the reader gave back. Writer's thread only; not real-time.
  void collect() {
    while (const auto returned = returned_.pop()) delete *returned;
  }

  /// The newest object not yet taken, or null (also while there is no room to give it and one held before back in one
  /// go). The reader keeps it, however many are offered later, and gives it back exactly once. Real-time: wait-free, no
  /// allocation.
  const T* take() noexcept {
    if (!offered_.load(std::memory_order_relaxed) || returned_.room() < 2) return nullptr;
    return offered_.exchange(nullptr, std::memory_order_acq_rel);
  }
  /// Hands an object back to be freed. Null is allowed. Precondition: at most one object is held beyond the one taken
  /// last, as when a new one takes an old one's place. Real-time: wait-free, no allocation.
  void give_back(const T* object) noexcept {
    if (object) returned_.push_or_count(object);  // there is room: take() has seen to it
  }

 private:
  std::atomic<const T*> offered_{nullptr};
  RecordRing<const T*, 8> returned_;
};

}  // namespace backwash::sync

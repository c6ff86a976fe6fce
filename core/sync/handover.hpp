// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <memory>

#include "core/sync/record_ring.hpp"

namespace backwash::sync {

/// Newest immutable object from one writer to one real-time reader, for objects that own memory. The writer allocates and
/// frees; the reader only moves pointers: what it has finished with goes back through a ring and is freed by the writer.
/// Exactly one thread may write and exactly one may read.
template <typename T>
class Handover {
 public:
  Handover() = default;
  Handover(const Handover&) = delete;
  Handover& operator=(const Handover&) = delete;
  /// Precondition: writer and reader have stopped.
  ~Handover() {
    delete offered_.load();
    delete current_;
    collect();
  }

  /// Offers an object in place of any that was not yet taken, and frees what the reader gave back. Not real-time.
  void offer(std::unique_ptr<const T> object) {
    collect();
    delete offered_.exchange(object.release(), std::memory_order_acq_rel);
  }
  /// The newest object taken so far, or null; it stays valid until the next call. Takes a new one only while there is room
  /// to give the old one back. Real-time: wait-free, no allocation.
  const T* newest() noexcept {
    if (!offered_.load(std::memory_order_relaxed)) return current_;
    if (current_ && !retired_.push(current_)) return current_;
    current_ = offered_.exchange(nullptr, std::memory_order_acq_rel);
    return current_;
  }
  /// Frees what the reader gave back. Writer's thread only; not real-time.
  void collect() {
    while (const auto retired = retired_.pop()) delete *retired;
  }

 private:
  std::atomic<const T*> offered_{nullptr};
  const T* current_ = nullptr;
  RecordRing<const T*, 8> retired_;
};

}  // namespace backwash::sync

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <fstream>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "services/backwashd/channels.hpp"

namespace backwash::daemon {

/// Writes the raw log from its own thread: the control thread's ring, and what the other threads append. A full disk or
/// a vanished directory costs records, which are counted, and nothing else (faults.md row 35).
class Recorder {
 public:
  /// Makes the file anew. Throws std::runtime_error naming it if that fails: at start it is a configuration error.
  explicit Recorder(const std::string& path);
  /// For every thread but the control thread's.
  void append(study::RecordKind kind, std::span<const std::uint8_t> bytes);
  void append(study::RecordKind kind, const std::string& text);
  /// Thread body: returns after `channels.stop` and one last drain.
  void run(Channels& channels);
  std::uint64_t lost() const noexcept { return lost_; }

 private:
  bool drain(Channels& channels);
  void write(const study::RecordHeader& header, const std::uint8_t* bytes);

  std::ofstream file_;
  std::mutex mutex_;
  std::vector<BulkRecord> pending_;
  std::atomic<std::uint64_t> lost_{0};
};

}  // namespace backwash::daemon

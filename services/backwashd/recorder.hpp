// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "firmware_bridge/port.hpp"
#include "services/backwashd/channels.hpp"

namespace backwash::daemon {

/// Writes the raw log from its own thread: the control thread's ring, and what the other threads append. A full disk or
/// a vanished directory costs records and nothing else (faults.md row 35): they are counted, one warning is given, and
/// a file that can be written again goes on with a `lost` record. Whole batches are written or taken back, so that the
/// file stays readable.
class Recorder {
 public:
  /// Makes the file anew. Throws std::runtime_error naming it if that fails: at start it is a configuration error.
  explicit Recorder(const std::string& path);
  /// For every thread but the control thread's.
  void append(study::RecordKind kind, std::span<const std::uint8_t> bytes);
  void append(study::RecordKind kind, const std::string& text);
  /// Writes what has come since the last call.
  void drain(Channels& channels);
  /// Thread body: drains every 20 ms; returns after `channels.stop` and one last drain.
  void run(Channels& channels);
  /// Records that the disk did not take.
  std::uint64_t lost() const noexcept { return lost_; }

 private:
  bool create();
  bool still_there() const;
  bool write(const std::vector<std::uint8_t>& bytes);
  void fail(std::uint64_t records, const char* why);
  static void put(std::vector<std::uint8_t>& to, const study::RecordHeader& header, const std::uint8_t* bytes);

  std::string path_;
  firmware_bridge::FileDescriptor file_;
  std::int64_t written_ = 0;  ///< bytes, all of whole records
  std::int64_t checked_ns_ = 0;
  bool failing_ = false;
  std::mutex mutex_;
  std::vector<BulkRecord> pending_;
  std::atomic<std::uint64_t> lost_{0};
};

}  // namespace backwash::daemon

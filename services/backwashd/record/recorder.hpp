// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/log/mcap/mcap_flight.hpp"
#include "firmware_bridge/port/port.hpp"
#include "services/backwashd/record/control_record.hpp"

namespace backwash::daemon {

struct Channels;

/// Writes the raw log as MCAP (core/log/mcap/mcap_flight.hpp) from its own thread: the real-time threads' rings, and
/// what the other threads append. A full disk, a vanished directory or a disk that does not answer costs records and
/// nothing else (docs/faults.md row 35): they are counted, a warning is given, and a file that can be written again
/// goes on with a `lost` record. What waits for the disk is bounded by kMostPending. Whole batches are written or taken
/// back, so that the file stays readable. Maps beyond kDrawnMaps are left to `backwash export` to draw.
///
/// A file that exists is never opened (row 45). `name` itself is taken if nothing has it, otherwise the next number
/// above those in its directory: flight.mcap, flight-2.mcap, flight-3.mcap … The file is 0640, and no link is
/// followed. One that has grown beyond its size is left once the mode is passive, and the next part begins: a flight
/// is in one of them. A part begins with what none can be read without: constants and the map. It is on the disk as far
/// as the last change of the mode, and no more than a second back: a power cut costs that, a kill the 20 ms since the
/// last batch. Of the disk 64 MiB are left to others, or a twentieth of a small one.
class Recorder {
 public:
  static constexpr std::size_t kMostPending = 64u << 20;  ///< bytes of other threads' records that wait for the disk

  /// 128 KiB are decoded in about 10 ms and drawn in 8 MB.
  static constexpr log::DrawnMaps kDrawnMaps{128u << 10, 60'000'000'000};

  /// Makes the file. `part_bytes`: size beyond which a part is left. Throws std::runtime_error naming the file if it
  /// cannot be made.
  explicit Recorder(const std::string& name, std::uint64_t part_bytes = std::numeric_limits<std::uint64_t>::max());
  /// Removes the file if nothing was recorded: a start that failed leaves none.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  /// For threads of ordinary priority alone, which share a lock here: what a real-time thread holds (ControlLoop,
  /// DdsFront) has no Recorder. Copies the bytes; waits for no disk.
  void append(log::RecordKind kind, std::span<const std::uint8_t> bytes);
  void append(log::RecordKind kind, const std::string& text);
  /// Writes what has come since the last call.
  void drain(Channels& channels);
  /// Thread body: drains every 20 ms; returns after `end`, one last drain and the file's end.
  void run(Channels& channels, const std::atomic<bool>& end);
  /// Records that did not get room or that the disk did not take; those of the rings are their own.
  std::uint64_t lost() const noexcept { return lost_; }
  /// The file's name now; the recorder's thread may change it.
  const std::string& path() const noexcept { return path_; }

 private:
  bool create();
  bool begin();
  void keep(const log::RawRecord& record);
  void finish();
  void leave_part();
  bool still_there() const;
  bool open_again(std::int64_t now);
  bool write(std::uint64_t at, std::span<const std::uint8_t> bytes);
  void write_batch(std::uint64_t lost_in_ring);
  void put(log::RawRecord record);
  void fail(const char* why);

  const std::string name_;
  const std::uint64_t part_bytes_;
  std::int64_t log_;                                ///< of PartRecord
  std::uint32_t part_ = 0;                          ///< number of the file, from 1
  std::map<log::RecordKind, log::RawRecord> kept_;  ///< for the beginning of the next part
  std::string path_;
  firmware_bridge::FileDescriptor file_;
  std::optional<log::McapFlight> mcap_;  ///< in the file
  const log::McapSink sink_ = [this](std::uint64_t at, auto bytes) { return write(at, bytes); };
  std::uint64_t written_ = 0;  ///< bytes, all of whole batches
  std::uint64_t begun_ = 0;    ///< of those the file's beginning
  std::int64_t checked_ns_ = 0;
  bool failing_ = false;
  std::uint32_t mode_ = 0;  ///< of the last tick record
  bool sync_due_ = false;
  std::vector<log::RawRecord> batch_;
  std::size_t batch_bytes_ = 0;
  std::uint64_t told_lost_ = 0;  ///< of the file's last `lost` record
  std::mutex mutex_;
  std::vector<log::RawRecord> pending_;
  std::atomic<std::size_t> pending_bytes_{0};
  std::atomic<std::uint64_t> lost_{0};
};

}  // namespace backwash::daemon

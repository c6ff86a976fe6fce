// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <string>

#include "firmware_bridge/mavlink/signing.hpp"
#include "firmware_bridge/port/port.hpp"

namespace backwash::daemon {

struct Controlled;

/// Keeps the time of our signatures from going back over restarts, whatever the wall clock says: a file holds a time
/// that is not reached before a later one is in it. After a crash the next start goes on there, up to kReserve early;
/// after an end in order it goes on at the last signature. Nothing here is real-time: the disk is waited for.
class SigningTimeFile {
 public:
  static constexpr mavlink::SigningTime kReserve = 10 * mavlink::kSigningSecond;

  /// Opens or makes the file (mode 0600, no link is followed) and reserves the first kReserve from start() on. Throws
  /// std::runtime_error naming it.
  SigningTimeFile(const std::string& path, std::chrono::system_clock::time_point wall);
  /// Where signatures go on: the wall clock, or what the file holds if that is later.
  mavlink::SigningTime start() const noexcept { return start_; }
  /// Writes a later time once less than half of the reserve is left. False: the disk did not take it.
  bool keep(mavlink::SigningTime last);
  /// No signature is made after `last`.
  bool close(mavlink::SigningTime last) { return write(last); }

 private:
  mavlink::SigningTime stored() const;
  bool write(mavlink::SigningTime time);

  std::string path_;
  firmware_bridge::FileDescriptor file_;
  mavlink::SigningTime start_ = 0, reserved_ = 0;
};

/// The file's name: beside the raw log, the daemon's one place to write.
std::string signing_time_path(const std::string& log);

/// Thread body, of a thread of its own because a disk may hang: keeps the file ahead of the link's signatures until
/// `end`; a disk that does not take it is told once.
void run_signing_time(SigningTimeFile& file, Controlled& channels, const std::atomic<bool>& end);

}  // namespace backwash::daemon

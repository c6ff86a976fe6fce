// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace backwash::log {

/// What of an autopilot's log was read, and what was not: counted while it is decoded, message by message.
class LogLoss {
 public:
  /// A message that fits, of so many bytes; its time in s if it tells one.
  void read(std::size_t bytes, std::optional<double> t_s = std::nullopt);
  /// Bytes that belong to no message that fits. Those that follow one another are one place.
  void skip(std::size_t bytes);
  /// So many of the messages that were read are none: their times fall.
  void misplace(std::size_t messages);
  /// The file ends within a message, of which so many bytes are there.
  void cut(std::size_t bytes);
  /// The logger itself says that it lost some, for so long (s).
  void dropout(double duration_s);

  std::size_t places() const noexcept { return places_; }
  std::size_t skipped() const noexcept { return skipped_; }  ///< bytes, with those of a message that was cut
  /// Share of the log that is lost, 0 … 1: bytes that were skipped, and those that never came. The latter by time: what
  /// the log wrote in a second as a rule, times what passed while a place lasted.
  double share() const;
  /// All of it, a sentence each; empty: nothing is lost.
  std::vector<std::string> words() const;

 private:
  double missing() const;
  std::size_t read_ = 0, skipped_ = 0, places_ = 0, timed_bytes_ = 0, timed_ = 0, dropouts_ = 0, misplaced_ = 0;
  std::size_t bridged_ = 0, bridged_bytes_ = 0, open_bytes_ = 0;  // places with a time on both sides; of the last one
  double bridged_s_ = 0, sound_s_ = 0, dropout_s_ = 0;            // sound: while nothing was damaged
  std::optional<double> newest_s_;
  bool damaged_ = false, cut_ = false;
};

/// How much later than all before it a message may be, s, unless one of so many behind it is as late: else its time is
/// damage. One may be earlier by any time: what was said before a log began is written into it.
inline constexpr double kNeighbours_s = 10;
inline constexpr int kNeighbours = 8;

}  // namespace backwash::log

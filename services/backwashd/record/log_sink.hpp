// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <spdlog/sinks/sink.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "core/sync/shared_ring.hpp"
#include "firmware_bridge/port/port.hpp"

namespace backwash::daemon {

/// Where the daemon's lines for the operator go: into a ring, and from there by one thread of its own to a descriptor,
/// so that a terminal that nobody reads, a full pipe or a closed one delays no thread that has something to say
/// (docs/faults.md row 44). What does not fit is dropped, counted, and said as soon as lines can be written again.
///
/// Text that others chose cannot forge lines or steer a terminal: all but printable ASCII is written as \xNN, and a
/// line ends after kLongest characters. A cause (level and text up to its first digit or quote) may say kBurst lines at
/// once, then kPerSecond; what was held back is told with its next line.
class LogSink : public spdlog::sinks::sink {
 public:
  static constexpr std::size_t kLongest = 400, kBurst = 20, kPerSecond = 5, kCapacity = 256;

  /// Each line begins with date, time and level, or, for a journal that keeps them itself, with "<N>", N the level of
  /// syslog.
  enum class Head { time, priority };

  /// Starts the writing thread. `fd`: usually standard error; it is not changed and not closed.
  static std::shared_ptr<LogSink> start(int fd, Head head = Head::time);
  LogSink(int fd, Head head);

  /// Of any thread. Lock-free, allocates nothing, calls nothing that waits.
  void log(const spdlog::details::log_msg& message) noexcept override;
  void flush() override {}
  void set_pattern(const std::string&) override {}
  void set_formatter(std::unique_ptr<spdlog::formatter>) override {}

  /// Lets the thread write what is left for `most_s` seconds, then ends it; one that hangs in the kernel is left
  /// behind.
  void close(double most_s);
  /// Lines that were dropped since start; those held back by the rate are not among them.
  std::uint64_t lost() const noexcept { return ring_.lost() + unwritten_; }

 private:
  struct Line {
    std::int64_t time_ns = 0;  ///< of the wall clock
    spdlog::level::level_enum level = spdlog::level::info;
    std::uint32_t held_back = 0;  ///< lines of the same cause before it
    std::size_t size = 0;
    std::array<char, kLongest> text;
  };
  struct Cause {
    std::atomic<std::int64_t> due_ns{0};  ///< when its lines so far are paid for
    std::atomic<std::uint32_t> held_back{0};
  };

  void run();
  bool write(std::string_view text);
  void say_lost(std::uint64_t& told);
  std::string format(const Line& line) const;

  sync::SharedRing<Line, kCapacity> ring_;
  std::array<Cause, 1024> causes_;       // by hash: so many that a flood hardly ever shares one with what matters
  firmware_bridge::FileDescriptor own_;  ///< the same pipe or terminal, opened again: non-blocking for us alone
  int fd_;
  Head head_;
  std::atomic<std::uint64_t> unwritten_{0};
  std::atomic<bool> closing_{false}, closed_{false}, abandoned_{false};
};

}  // namespace backwash::daemon

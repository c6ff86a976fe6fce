// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <signal.h>

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "services/command_line/exit_code.hpp"

/// What ends the process, and what does not.
namespace backwash::daemon {

/// The first thing that went wrong in any thread; it ends the flight. Setting `stop` is what makes the control thread
/// silent: within a tick it sends nothing more.
class Failure {
 public:
  explicit Failure(std::atomic<bool>& stop) : stop_(stop) {}
  /// "THREAD: WHAT", and the exit code. Allocates nothing, takes no lock, may be called by a signal handler.
  void note(const char* thread, const char* what, int code = kSoftware) noexcept;
  bool happened() const noexcept { return noted_.load(std::memory_order_acquire); }
  /// Empty before it happened.
  std::string text() const { return happened() ? text_.data() : ""; }
  int code() const noexcept { return happened() ? code_ : 0; }

 private:
  std::atomic<bool>& stop_;
  std::atomic<bool> claimed_{false}, noted_{false};
  std::array<char, 256> text_{};
  int code_ = 0;
};

/// Threads whose exceptions end in a Failure, never in std::terminate.
class Threads {
 public:
  explicit Threads(Failure& failure) : failure_(failure) {}
  /// Precondition: join() has returned true.
  ~Threads() = default;
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

  /// `name`: a literal. Throws std::system_error if the system has no thread left.
  void start(const char* name, std::function<void()> body);
  /// Waits until all have ended, at most until `latest`. False: one is still at work.
  bool join(std::chrono::steady_clock::time_point latest);

 private:
  Failure& failure_;
  std::atomic<int> running_{0};
  std::vector<std::thread> threads_;
};

/// Does `work` in a thread of its own. False: it was not done by `latest`, and goes on until the process ends; or no
/// thread was to be had, and it is left undone.
bool done_by(std::chrono::steady_clock::time_point latest, std::function<void()> work);

/// At start, before any file is opened and any thread started:
/// - a standard descriptor that is closed is opened on /dev/null, so that no port or log ever gets its number;
/// - SIGPIPE, SIGXFSZ, SIGTTOU, SIGTTIN and SIGTSTP are ignored: a pipe, a limit or a terminal never ends or stops a
///   flight; nor do SIGUSR1 and SIGUSR2, by which scripts ask programs for a new log;
/// - SIGINT, SIGTERM, SIGQUIT and SIGHUP are blocked in every thread and left to wait_for_end().
/// Returns the blocked ones.
sigset_t shield_process();

/// While it lives std::terminate and abort (libraries without exceptions: no memory) end in `failure` too: the calling
/// thread stays where it is, the others are ended in order, and the process after 2 s in any case. One at a time.
class CatchTheRest {
 public:
  explicit CatchTheRest(Failure& failure);
  ~CatchTheRest();
  CatchTheRest(const CatchTheRest&) = delete;
  CatchTheRest& operator=(const CatchTheRest&) = delete;
};

/// Gives every thread of ordinary scheduling niceness 0 where that is allowed: a thread ends, or is ended, only when it
/// runs, and one of low priority runs seldom beside busy processors.
void let_all_run();

/// Returns on SIGINT, SIGTERM, SIGQUIT or a failure. SIGHUP is told and ignored: a flight does not end with a terminal.
/// Calls `look` every 50 ms.
void wait_for_end(
    const sigset_t& signals, const Failure& failure, const std::function<void()>& look = [] {});

}  // namespace backwash::daemon

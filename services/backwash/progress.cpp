// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "core/types/text.hpp"
#include "services/parallel/parallel.hpp"

namespace backwash::services {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kFirst = 2s;   // what takes less is not shown on a terminal
constexpr auto kBar = 200ms;  // between two pictures of the bar
constexpr auto kLine = 10s;   // between two lines where there is no terminal
constexpr std::size_t kCells = 24;

volatile std::sig_atomic_t signal_that_came = 0;

double since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

/// What is at work, shown by a thread of its own.
class Display {
 public:
  void begin(const std::string& what) {
    if (quiet_) return;
    const std::lock_guard lock(mutex_);
    what_ = what;
    begun_ = Clock::now();
    done_ = of_ = 0;
    if (thread_.joinable()) return;
    shown_ = terminal_ ? begun_ + kFirst - kBar : begun_;
    thread_ = std::jthread([this](const std::stop_token& end) { run(end); });
  }
  void set(std::size_t done, std::size_t of) {
    const std::lock_guard lock(mutex_);
    if (of_ != of || done == 0) {
      begun_ = Clock::now();
      done_ = 0;
    }
    done_ = std::max(done_, done);
    of_ = of;  // threads may be late with what they say
  }
  void end() {
    if (!thread_.joinable()) return;
    thread_.request_stop();
    thread_.join();
    thread_ = {};
    if (std::exchange(drawn_, false)) std::fputs("\r\x1b[K", stderr);
  }
  void be_quiet() { quiet_ = true; }

 private:
  void run(const std::stop_token& end) {
    std::unique_lock lock(mutex_);
    while (!end.stop_requested()) {
      wake_.wait_until(lock, end, Clock::now() + kBar / 2, [] { return false; });
      if (end.stop_requested() || Clock::now() - shown_ < (terminal_ ? Clock::duration{kBar} : Clock::duration{kLine}))
        continue;
      shown_ = Clock::now();
      const std::string line = progress_line(what_, done_, of_, since(begun_), terminal_);
      std::fprintf(stderr, terminal_ ? "\r\x1b[K%s" : "%s\n", line.c_str());
      std::fflush(stderr);
      drawn_ = terminal_;
    }
  }

  const bool terminal_ = ::isatty(STDERR_FILENO) != 0;
  std::atomic<bool> quiet_{false};
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::string what_;
  std::size_t done_ = 0, of_ = 0;
  Clock::time_point begun_, shown_;
  bool drawn_ = false;  ///< a bar is on the terminal
  std::jthread thread_;
};

/// The program has one stderr.
Display& display() {
  static Display one;
  return one;
}

}  // namespace

std::string progress_line(const std::string& what, std::size_t done, std::size_t of, double stage_s, bool bar) {
  if (of == 0) return what + ", " + to_text(stage_s, 0) + " s";
  const double share = static_cast<double>(done) / static_cast<double>(of);
  std::string line = what;
  if (bar) {
    const auto full = static_cast<std::size_t>(share * kCells);
    line += " [" + std::string(full, '#') + std::string(kCells - full, '.') + "]";
  }
  line += (bar ? " " : ": ") + to_text(100 * share, 0) + " %, " + std::to_string(done) + " of " + std::to_string(of);
  if (done == 0 || !(stage_s > 0)) return line;
  const double rate = static_cast<double>(done) / stage_s;
  return line + ", " + to_text(rate, rate < 10 ? 1 : 0) + "/s, " + to_text(static_cast<double>(of - done) / rate, 0) +
         " s left";
}

void progress(const std::string& what) { display().begin(what); }
void progress(std::size_t done, std::size_t of) { display().set(done, of); }
void end_progress() { display().end(); }
void be_quiet() { display().be_quiet(); }

void run_shown(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) {
  std::atomic<std::size_t> done{0};
  progress(0, count);
  run_parallel(count, [&](std::size_t begin, std::size_t end) {
    if (interrupted()) throw Interrupted{};
    work(begin, end);
    progress(done += end - begin, count);
  });
}

void finish_what_is_done() {
  struct sigaction act {};
  act.sa_handler = [](int which) { signal_that_came = which; };
  act.sa_flags = static_cast<int>(SA_RESETHAND);
  ::sigaction(SIGINT, &act, nullptr);
}

bool interrupted() noexcept { return signal_that_came != 0; }

}  // namespace backwash::services

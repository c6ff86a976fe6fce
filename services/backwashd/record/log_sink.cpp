// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/record/log_sink.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <functional>
#include <string_view>
#include <thread>

namespace backwash::daemon {
namespace {

using namespace std::chrono_literals;
constexpr auto kPoll = 10ms;

bool printable(char c) { return c >= ' ' && c <= '~'; }

/// As syslog(3) numbers levels.
int priority_of(spdlog::level::level_enum level) {
  switch (level) {
    case spdlog::level::critical:
      return 2;
    case spdlog::level::err:
      return 3;
    case spdlog::level::warn:
      return 4;
    case spdlog::level::info:
      return 6;
    default:
      return 7;
  }
}

/// Level and text up to what differs between lines of one kind.
std::size_t cause_of(spdlog::level::level_enum level, std::string_view text) {
  const auto differs =
      std::ranges::find_if(text, [](char c) { return !printable(c) || (c >= '0' && c <= '9') || c == '\''; });
  return std::hash<std::string_view>{}(text.substr(0, static_cast<std::size_t>(differs - text.begin()))) +
         static_cast<std::size_t>(level);
}

/// What may be said of one cause is paid by time (generic cell rate): true if a line at `now_ns` may go out.
bool pay(std::atomic<std::int64_t>& due_ns, std::int64_t now_ns) noexcept {
  constexpr std::int64_t kPrice = 1'000'000'000 / LogSink::kPerSecond, kCredit = LogSink::kBurst * kPrice;
  std::int64_t due = due_ns.load(std::memory_order_relaxed);
  for (;;) {
    const std::int64_t next = std::max(due, now_ns) + kPrice;
    if (next - now_ns > kCredit) return false;
    if (due_ns.compare_exchange_weak(due, next, std::memory_order_relaxed)) return true;
  }
}

// Non-blocking for us alone: the flag would belong to everybody who shares the terminal or pipe. Sockets and files
// cannot be opened again, and need not be.
int opened_again(int fd) {
  struct stat status {};
  if (::fstat(fd, &status) != 0 || !(S_ISFIFO(status.st_mode) || S_ISCHR(status.st_mode))) return -1;
  const std::string path = "/proc/self/fd/" + std::to_string(fd);
  return ::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
}

}  // namespace

LogSink::LogSink(int fd, Head head) : own_(opened_again(fd)), fd_(own_.get() >= 0 ? own_.get() : fd), head_(head) {}

std::shared_ptr<LogSink> LogSink::start(int fd, Head head) {
  auto sink = std::make_shared<LogSink>(fd, head);
  // Owned by its thread too: one that hangs in a write outlives close().
  std::thread([sink] { sink->run(); }).detach();
  return sink;
}

void LogSink::log(const spdlog::details::log_msg& message) noexcept {
  const std::string_view text(message.payload.data(), message.payload.size());
  Cause& cause = causes_[cause_of(message.level, text) % causes_.size()];
  const auto steady = std::chrono::steady_clock::now().time_since_epoch();
  if (!pay(cause.due_ns, std::chrono::duration_cast<std::chrono::nanoseconds>(steady).count())) {
    cause.held_back.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  Line line;
  line.time_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(message.time.time_since_epoch()).count();
  line.level = message.level;
  line.held_back = cause.held_back.exchange(0, std::memory_order_relaxed);
  constexpr char kHex[] = "0123456789abcdef";
  constexpr std::string_view kCut = "...";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const std::size_t needed = printable(c) ? 1 : 4;
    if (line.size + needed + kCut.size() > kLongest) {
      std::ranges::copy(kCut, line.text.begin() + static_cast<std::ptrdiff_t>(line.size));
      line.size += kCut.size();
      break;
    }
    if (needed == 1) {
      line.text[line.size++] = c;
    } else {
      for (const char escaped : {'\\', 'x', kHex[byte >> 4], kHex[byte & 15]}) line.text[line.size++] = escaped;
    }
  }
  ring_.push_or_count(line);
}

std::string LogSink::format(const Line& line) const {
  const time_t seconds = line.time_ns / 1'000'000'000;
  tm local{};
  ::localtime_r(&seconds, &local);
  char date[32], head[64];
  std::strftime(date, sizeof date, "%Y-%m-%d %H:%M:%S", &local);
  const auto level = spdlog::level::to_string_view(line.level);
  if (head_ == Head::priority)
    std::snprintf(head, sizeof head, "<%d>", priority_of(line.level));
  else
    std::snprintf(head, sizeof head, "[%s.%03d] [%.*s] ", date, static_cast<int>(line.time_ns / 1'000'000 % 1000),
                  static_cast<int>(level.size()), level.data());
  std::string text = head + std::string(line.text.data(), line.size);
  if (line.held_back > 0) text += " (and " + std::to_string(line.held_back) + " more of this kind)";
  return text + "\n";
}

// False: it can never be written, or close() does not wait for it any longer.
bool LogSink::write(std::string_view text) {
  while (!text.empty() && !abandoned_) {
    pollfd ready{fd_, POLLOUT, 0};
    if (::poll(&ready, 1, static_cast<int>(kPoll.count())) != 1) continue;
    ssize_t n = ::send(fd_, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (n < 0 && errno == ENOTSOCK) n = ::write(fd_, text.data(), text.size());
    if (n >= 0)
      text.remove_prefix(static_cast<std::size_t>(n));
    else if (errno == EAGAIN)
      std::this_thread::sleep_for(kPoll);
    else if (errno != EINTR)
      return false;
  }
  return text.empty();
}

void LogSink::say_lost(std::uint64_t& told) {
  const std::uint64_t now = lost();
  if (now == told) return;
  Line line;
  line.time_ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
  line.level = spdlog::level::warn;
  line.size = static_cast<std::size_t>(std::snprintf(line.text.data(), line.text.size(),
                                                     "%llu lines were lost: they came faster than they were read",
                                                     static_cast<unsigned long long>(now - told)));
  if (write(format(line))) told = now;
}

void LogSink::run() {
  std::uint64_t told = 0;
  for (bool last = false; !last && !abandoned_;) {
    last = closing_;  // before the ring is found empty
    try {
      // No more than the ring holds between two looks at what was lost.
      for (std::size_t n = 0; n < kCapacity; ++n) {
        const auto line = ring_.pop();
        if (!line) break;
        if (!write(format(*line))) ++unwritten_;
      }
      say_lost(told);
    } catch (const std::exception&) {
      ++unwritten_;  // no memory for a line
    }
    if (!last) std::this_thread::sleep_for(kPoll);
  }
  closed_ = true;
}

void LogSink::close(double most_s) {
  closing_ = true;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(most_s);
  while (!closed_ && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(1ms);
  abandoned_ = true;
}

}  // namespace backwash::daemon

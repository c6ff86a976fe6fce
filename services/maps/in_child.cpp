// SPDX-License-Identifier: BSD-3-Clause
#include "services/maps/in_child.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <iterator>

namespace backwash::maps {
namespace {

/// Never returns; exit code 0 if `work` came to its end and all that it said was taken.
[[noreturn]] void be_child(const std::function<void(const Sink&)>& work, std::size_t seconds, std::size_t most_bytes,
                           int out) {
  [[maybe_unused]] const rlimit time{seconds, seconds}, none{0, 0}, memory{most_bytes, most_bytes};
  ::setrlimit(RLIMIT_CPU, &time);
  ::setrlimit(RLIMIT_CORE, &none);
#ifndef __SANITIZE_ADDRESS__
  ::setrlimit(RLIMIT_AS, &memory);
#endif
  try {
    work([out](const char* bytes, std::size_t count) {
      while (count > 0) {
        const ssize_t n = ::write(out, bytes, count);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) ::_exit(1);
        bytes += n;
        count -= static_cast<std::size_t>(n);
      }
    });
  } catch (...) {
    ::_exit(1);
  }
  ::_exit(0);
}

std::string how(int status, std::size_t seconds) {
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGKILL || WTERMSIG(status) == SIGXCPU))
    return "was ended after " + std::to_string(seconds) + " s, or for want of memory";
  if (WIFSIGNALED(status)) return "ended with signal " + std::to_string(WTERMSIG(status));
  return "gave up, for want of memory or by a defect";
}

}  // namespace

tl::expected<std::string, std::string> in_child(const std::function<void(const Sink&)>& work, std::size_t seconds,
                                                std::size_t most_bytes) {
  using Tasks = std::filesystem::directory_iterator;
  std::error_code unknown;
  if (std::distance(Tasks("/proc/self/task", unknown), Tasks()) > 1)
    return tl::make_unexpected(
        "cannot be started: this process has other threads, whose locks a fork would keep for ever");
  int pipe[2];
  const auto no = [] { return tl::make_unexpected("cannot be started: " + std::string(std::strerror(errno))); };
  if (::pipe(pipe) != 0) return no();
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(pipe[0]);
    be_child(work, seconds, most_bytes, pipe[1]);
  }
  ::close(pipe[1]);
  std::string said, part(1 << 16, '\0');
  for (ssize_t n = 1; child > 0 && n != 0;) {
    n = ::read(pipe[0], part.data(), part.size());
    if (n < 0 && errno != EINTR) break;
    if (n > 0) said.append(part, 0, static_cast<std::size_t>(n));
  }
  ::close(pipe[0]);
  if (child < 0) return no();
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (status != 0) return tl::make_unexpected(how(status, seconds));
  return said;
}

}  // namespace backwash::maps

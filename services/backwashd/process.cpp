// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/process.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <future>
#include <system_error>
#include <utility>

namespace backwash::daemon {
namespace {

using namespace std::chrono_literals;

// Handlers have no other way to it.
std::atomic<Failure*> failure_of_process{nullptr};

// The thread cannot go on and cannot be left: its frames may hold what others use.
[[noreturn]] void stay() noexcept {
  constexpr unsigned kClosing = 2;  // s; SIGALRM ends the process if main cannot
  ::alarm(kClosing);
  for (;;) ::pause();
}

void on_abort(int) {
  if (Failure* failure = failure_of_process) failure->note("abort", "a library gave up");
  stay();
}

[[noreturn]] void on_terminate() {
  Failure* failure = failure_of_process;
  try {
    if (std::current_exception()) std::rethrow_exception(std::current_exception());
    failure->note("terminate", "without an exception");
  } catch (const std::exception& e) {
    failure->note("terminate", e.what());
  } catch (...) {
    failure->note("terminate", "an exception of unknown type");
  }
  stay();
}

}  // namespace

void Failure::note(const char* thread, const char* what, int code) noexcept {
  if (!claimed_.exchange(true)) {
    code_ = code;
    std::size_t size = 0;
    for (const char* part : {thread, ": ", what})
      while (*part && size + 1 < text_.size()) text_[size++] = *part++;
    noted_.store(true, std::memory_order_release);
  }
  stop_ = true;
}

void Threads::start(const char* name, std::function<void()> body) {
  ++running_;
  try {
    threads_.emplace_back([this, name, body = std::move(body)] {
      try {
        body();
      } catch (const std::exception& e) {
        failure_.note(name, e.what());
      } catch (...) {
        failure_.note(name, "an exception of unknown type");
      }
      --running_;
    });
  } catch (...) {
    --running_;
    throw;
  }
}

bool Threads::join(std::chrono::steady_clock::time_point latest) {
  while (running_ > 0) {
    if (std::chrono::steady_clock::now() > latest) return false;
    std::this_thread::sleep_for(1ms);
  }
  for (std::thread& thread : threads_)
    if (thread.joinable()) thread.join();
  return true;
}

bool done_by(std::chrono::steady_clock::time_point latest, std::function<void()> work) {
  std::promise<void> promise;
  const auto done = promise.get_future();
  try {
    std::thread([work = std::move(work), promise = std::move(promise)]() mutable {
      work();
      promise.set_value();
    }).detach();
  } catch (const std::system_error&) {
    return false;  // no thread is to be had: left undone, as what hangs is
  }
  return done.wait_until(latest) == std::future_status::ready;
}

sigset_t shield_process() {
  for (int fd = ::open("/dev/null", O_RDWR); fd >= 0; fd = ::open("/dev/null", O_RDWR)) {
    if (fd <= STDERR_FILENO) continue;
    ::close(fd);
    break;
  }
  for (const int ignored : {SIGPIPE, SIGXFSZ, SIGTTOU, SIGTTIN, SIGTSTP, SIGUSR1, SIGUSR2}) ::signal(ignored, SIG_IGN);
  sigset_t set;
  sigemptyset(&set);
  for (const int waited : {SIGINT, SIGTERM, SIGQUIT, SIGHUP}) sigaddset(&set, waited);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  return set;
}

void let_all_run() {
  std::error_code none;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", none)) {
    const auto thread = static_cast<id_t>(std::strtoul(task.path().filename().c_str(), nullptr, 10));
    if (::getpriority(PRIO_PROCESS, thread) > 0) ::setpriority(PRIO_PROCESS, thread, 0);
  }
}

CatchTheRest::CatchTheRest(Failure& failure) {
  failure_of_process = &failure;
  std::set_terminate(on_terminate);
  ::signal(SIGABRT, on_abort);
}

CatchTheRest::~CatchTheRest() {
  std::set_terminate(std::abort);
  ::signal(SIGABRT, SIG_DFL);
  failure_of_process = nullptr;
}

void wait_for_end(const sigset_t& signals, const Failure& failure, const std::function<void()>& look) {
  const timespec between{0, 50'000'000};
  while (!failure.happened()) {
    look();
    const int signal = sigtimedwait(&signals, nullptr, &between);
    if (signal == SIGHUP)
      spdlog::warn("SIGHUP: ignored, a flight does not end with its terminal; SIGTERM or SIGINT ends the daemon");
    else if (signal > 0)
      return;
  }
}

}  // namespace backwash::daemon

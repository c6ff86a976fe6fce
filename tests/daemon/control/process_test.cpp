// SPDX-License-Identifier: BSD-3-Clause
// Rows 44 and 50 of docs/faults.md: what a signal, a closed descriptor or an exception does to the process.
#include "services/backwashd/process.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <new>
#include <stdexcept>
#include <vector>

#include "services/backwashd/control/control_loop.hpp"
#include "tests/daemon/lockstep/traps.hpp"

namespace backwash::daemon {
namespace {

using namespace std::chrono_literals;

std::chrono::steady_clock::time_point after(std::chrono::nanoseconds time) {
  return std::chrono::steady_clock::now() + time;
}

/// What `body` returns in a process of its own; 1000 + N: signal N killed it.
template <typename Body>
int in_a_process(Body&& body) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(body());
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFSIGNALED(status) ? 1000 + WTERMSIG(status) : WEXITSTATUS(status);
}

TEST(ThreadFault, AnExceptionInAThreadEndsTheOthersAndKeepsItsNameAndText) {
  std::atomic<bool> stop{false};
  Failure failure(stop);
  Threads threads(failure);
  int ticks = 0;
  threads.start("control", [&] {
    for (; !stop; ++ticks) std::this_thread::sleep_for(1ms);
  });
  EXPECT_EQ(failure.text(), "");
  EXPECT_EQ(failure.code(), 0);
  threads.start("planner", [] { throw std::runtime_error("no such primitive"); });
  EXPECT_TRUE(threads.join(after(10s)));
  EXPECT_TRUE(stop);
  EXPECT_EQ(failure.text(), "planner: no such primitive");
  EXPECT_EQ(failure.code(), 70);
  failure.note("mission", "later ones do not take its place");
  EXPECT_EQ(failure.text(), "planner: no such primitive");
}

TEST(ThreadFault, AFailedAllocationAndAThrownNumberAreFailuresToo) {
  for (const bool memory : {true, false}) {
    std::atomic<bool> stop{false};
    Failure failure(stop);
    Threads threads(failure);
    threads.start("map worker", [&] {
      if (memory) static_cast<void>(std::vector<double>(std::size_t{1} << 58));
      throw 42;
    });
    EXPECT_TRUE(threads.join(after(10s)));
    EXPECT_EQ(failure.text(), memory ? "map worker: std::bad_alloc" : "map worker: an exception of unknown type");
  }
}

// Beside busy processors a thread of niceness 10 may not run for seconds, not even to be ended.
TEST(Ending, EveryThreadIsGivenOrdinaryPriorityWhereAllowed) {
  const int code = in_a_process([] {
    std::atomic<pid_t> low{0};
    std::thread([&] {
      ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), 10);
      low = ::gettid();
      ::pause();
    }).detach();
    while (low == 0) std::this_thread::sleep_for(1ms);
    rlimit limit{};
    ::getrlimit(RLIMIT_NICE, &limit);
    if (::geteuid() != 0 && limit.rlim_cur < 20) return 100;
    const bool was_low = ::getpriority(PRIO_PROCESS, static_cast<id_t>(low)) == 10;
    let_all_run();
    return was_low && ::getpriority(PRIO_PROCESS, static_cast<id_t>(low)) == 0 ? 5 : 1;
  });
  if (code == 100) GTEST_SKIP() << "right: RLIMIT_NICE does not allow it";
  EXPECT_EQ(code, 5);
}

TEST(Process, WorkThatHangsIsWaitedForNoLongerThanAsked) {
  const int code = in_a_process([] {
    const auto begun = std::chrono::steady_clock::now();
    if (!done_by(after(10s), [] {})) return 1;
    if (std::chrono::steady_clock::now() - begun > 5s) return 2;
    ::alarm(20);
    if (done_by(after(50ms), [] { ::pause(); })) return 3;
    ::_exit(7);
  });
  EXPECT_EQ(code, 7);
}

// At the end of a flight in which memory has run out nothing may throw: all is said and stored by then.
TEST(Process, WorkThatGetsNoThreadIsLeftUndone) {
  const int code = in_a_process([] {
    pthread_attr_t attr;
    pthread_attr_init(&attr);
    pthread_attr_setstacksize(&attr, std::size_t{1} << 30);  // or one that an earlier thread has left would do
    const rlimit none{1 << 20, 1 << 20};                     // less than there is already
    if (pthread_setattr_default_np(&attr) != 0 || ::setrlimit(RLIMIT_AS, &none) != 0) return 1;
    return done_by(after(10s), [] {}) ? 2 : 7;
  });
  EXPECT_EQ(code, 7);
}

TEST(ThreadFault, AThreadThatHangsIsWaitedForNoLongerThanAsked) {
  const int code = in_a_process([] {
    std::atomic<bool> stop{false};
    Failure failure(stop);
    Threads threads(failure);
    threads.start("status", [] { ::pause(); });
    return threads.join(after(50ms)) ? 1 : (::_exit(7), 0);
  });
  EXPECT_EQ(code, 7);
}

// What no catch sees: a throwing function that promised not to, and a C library without memory.
TEST(ThreadFault, TerminateAndAbortInAThreadLeaveTheOthersToCloseDown) {
  for (const bool aborts : {true, false}) {
    const int code = in_a_process([aborts] {
      std::atomic<bool> stop{false};
      Failure failure(stop);
      const CatchTheRest rest(failure);
      Threads threads(failure);
      threads.start("reader", [aborts] {
        if (aborts) std::abort();
        []() noexcept { std::vector<int>().at(7); }();
      });
      const sigset_t signals = shield_process();
      wait_for_end(signals, failure);
      const bool right = failure.text() ==
                         (aborts ? "abort: a library gave up"
                                 : "terminate: vector::_M_range_check: __n (which is 7) >= this->size() (which is 0)");
      ::_exit(stop && right && !threads.join(after(50ms)) ? failure.code() : 1);
      return 0;
    });
    EXPECT_EQ(code, 70) << (aborts ? "abort" : "terminate");
  }
}

TEST(StandardOutputFault, PipesTerminalsAndLimitsKillAndStopNoProcessAndHangUpsAreIgnored) {
  const int code = in_a_process([] {
    const sigset_t signals = shield_process();
    std::atomic<bool> stop{false};
    Failure failure(stop);
    for (const int harmless : {SIGPIPE, SIGXFSZ, SIGTTOU, SIGTTIN, SIGTSTP, SIGUSR1, SIGUSR2, SIGHUP})
      ::kill(::getpid(), harmless);
    const auto begun = std::chrono::steady_clock::now();
    std::thread later([] {
      std::this_thread::sleep_for(100ms);
      ::kill(::getpid(), SIGTERM);
    });
    wait_for_end(signals, failure);
    later.join();
    return std::chrono::steady_clock::now() - begun >= 90ms ? 5 : 1;
  });
  EXPECT_EQ(code, 5);
}

// Ctrl-\\: as it is, the log would end without what the last ticks decided.
TEST(StandardOutputFault, AQuitOfTheTerminalIsAnEndInOrder) {
  const int code = in_a_process([] {
    const sigset_t signals = shield_process();
    std::atomic<bool> stop{false};
    Failure failure(stop);
    ::kill(::getpid(), SIGQUIT);
    wait_for_end(signals, failure);
    return failure.happened() ? 1 : 5;
  });
  EXPECT_EQ(code, 5);
}

TEST(StandardOutputFault, AClosedStandardDescriptorIsNeverGivenToAPortOrLog) {
  const int code = in_a_process([] {
    ::close(STDIN_FILENO);
    ::close(STDERR_FILENO);
    shield_process();
    const int next = ::open("/dev/null", O_RDONLY);
    return next > STDERR_FILENO && ::write(STDERR_FILENO, "x", 1) == 1 ? 5 : 1;
  });
  EXPECT_EQ(code, 5);
}

// MCL_FUTURE under a finite limit: the memory for the next map would be refused in flight.
TEST(MemoryLock, UnderAFiniteLimitOnlyWhatIsThereIsLockedOtherwiseLaterMemoryToo) {
  if (!backwash::test::traps_work()) GTEST_SKIP() << "sanitizer: it owns the C library's functions";
  constexpr rlim_t kFinite = 8u << 20;
  const auto locks = [](bool capable) {
    return in_a_process([capable] {
      __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
      __user_cap_data_struct data[_LINUX_CAPABILITY_U32S_3]{};
      ::syscall(SYS_capget, &header, data);
      if (capable && !(data[0].effective & (1u << CAP_IPC_LOCK))) return 100;
      if (!capable) data[0].effective &= ~(1u << CAP_IPC_LOCK);
      const rlimit limit{kFinite, kFinite};
      if (::syscall(SYS_capset, &header, data) != 0 || ::setrlimit(RLIMIT_MEMLOCK, &limit) != 0) return 101;
      lock_memory();
      return backwash::test::locked_with();
    });
  };
  EXPECT_EQ(locks(false), MCL_CURRENT);
  const int capable = locks(true);
  if (capable == 100) GTEST_SKIP() << "right: CAP_IPC_LOCK is not there to lift the limit";
  EXPECT_EQ(capable, MCL_CURRENT | MCL_FUTURE);
}

}  // namespace
}  // namespace backwash::daemon

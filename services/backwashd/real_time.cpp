// SPDX-License-Identifier: BSD-3-Clause
#include <linux/capability.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/control/control_loop.hpp"
#include "services/parallel/real_time.hpp"

namespace backwash::daemon {
namespace {

constexpr std::int64_t kPeriod_ns = 20'000'000, kListen_ns = 2'000'000;
constexpr std::size_t kStackToTouch = 256u << 10;
constexpr std::size_t kStack = 512u << 10;  // a flight through a building touches 28 KiB of it, the control thread 256
constexpr int kOwnMapping = 256 << 10;      // bytes from which an allocation returns to the system when it ends

void sleep_until(std::int64_t when_ns) {
  const timespec wake{when_ns / 1'000'000'000, when_ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, nullptr) == EINTR) {
  }
}

// Touches stack below the current frame, so that the loop's first deep call faults no page.
void prefault_stack() {
  volatile char stack[kStackToTouch];
  for (std::size_t i = 0; i < kStackToTouch; i += 4096) stack[i] = 0;
  (void)stack[0];
}

// The kernel asks for it where a lock would pass RLIMIT_MEMLOCK.
bool may_lock_beyond_limit() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct data[_LINUX_CAPABILITY_U32S_3]{};
  return ::syscall(SYS_capget, &header, data) == 0 && (data[0].effective & (1u << CAP_IPC_LOCK)) != 0;
}

}  // namespace

void limit_memory() {
  // The C library raises this threshold by itself; what a world leaves behind then stays, in holes of the heap. It has
  // a heap for each thread too: what one thread's worlds left behind is lost to the next thread, and more so the more
  // processors there are.
  mallopt(M_MMAP_THRESHOLD, kOwnMapping);
  mallopt(M_ARENA_MAX, 1);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  if (pthread_attr_setstacksize(&attributes, kStack) != 0 || pthread_setattr_default_np(&attributes) != 0)
    spdlog::warn("each thread's stack is as large as `ulimit -s` says, and locked");
  pthread_attr_destroy(&attributes);
}

void lock_memory() {
  rlimit limit{};
  ::getrlimit(RLIMIT_MEMLOCK, &limit);
  const bool finite = limit.rlim_cur != RLIM_INFINITY && !may_lock_beyond_limit();
  const bool locked = mlockall(finite ? MCL_CURRENT : MCL_CURRENT | MCL_FUTURE) == 0;
  if (finite && locked) {
    spdlog::info("RLIMIT_MEMLOCK is {} KiB: memory for later maps is not locked; let the machine have no swap",
                 limit.rlim_cur / 1024);
  } else if (finite) {
    spdlog::warn("RLIMIT_MEMLOCK is {} KiB: memory is not locked, page faults may delay ticks; raise LimitMEMLOCK",
                 limit.rlim_cur / 1024);
  } else if (!locked) {
    spdlog::warn("memory is not locked ({}): page faults may delay ticks; grant CAP_IPC_LOCK or LimitMEMLOCK",
                 std::strerror(errno));
  }
}

void make_real_time(const Scheduling& scheduling) {
  lock_memory();
  prefault_stack();
  if (scheduling.cpu) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<std::size_t>(*scheduling.cpu), &set);
    if (sched_setaffinity(0, sizeof set, &set) != 0)
      spdlog::warn("the control thread is not bound to processor {} ({}): set control.cpu to one that exists",
                   *scheduling.cpu, std::strerror(errno));
  }
  if (scheduling.priority == 0) {
    spdlog::warn("control.priority is 0: the control thread has ordinary scheduling, ticks may be late");
  } else if (!set_fifo(scheduling.priority)) {
    spdlog::warn("SCHED_FIFO {} is not allowed ({}): ticks may be late; grant CAP_SYS_NICE or LimitRTPRIO",
                 scheduling.priority, std::strerror(errno));
  }
}

void run_control(Channels& channels, ControlLoop& loop, const ServiceManager& manager) {
  std::int64_t due = now_ns() + kPeriod_ns;
  while (!channels.stop) {
    // What falls behind is left out: the tick reads the port itself.
    for (std::int64_t next = now_ns() + kListen_ns; next < due; next = now_ns() + kListen_ns) {
      sleep_until(next);
      loop.listen(now_ns());
    }
    sleep_until(due);
    const std::int64_t woken = now_ns();
    // Whole periods that have passed since this one was due are skipped; the phase stays.
    const std::int64_t missed = (woken - due) / kPeriod_ns;
    due += missed * kPeriod_ns;
    loop.tick(woken, static_cast<int>(missed), static_cast<double>(woken - due) * 1e-3);
    if (loop.view().ticks % kAliveTicks == 0) manager.alive();
    loop.took(static_cast<double>(now_ns() - woken) * 1e-3);
    due += kPeriod_ns;
  }
}

}  // namespace backwash::daemon

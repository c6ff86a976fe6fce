// SPDX-License-Identifier: BSD-3-Clause
#include "services/parallel/real_time.hpp"

#include <pthread.h>
#include <sched.h>

#include <cerrno>
#include <thread>

namespace backwash {

bool set_fifo(int priority) noexcept {
  sched_param parameters{};
  parameters.sched_priority = priority;
  errno = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  return errno == 0;
}

int allowed_fifo(int priority) {
  bool allowed = false;
  if (priority > 0) std::thread([&] { allowed = set_fifo(priority); }).join();
  return allowed ? priority : 0;
}

}  // namespace backwash

// SPDX-License-Identifier: BSD-3-Clause
#include "services/parallel/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace backwash {
namespace {

std::atomic<unsigned> most_threads{0};

unsigned thread_count() {
  const unsigned all = std::max(1u, std::thread::hardware_concurrency()), most = most_threads;
  return most == 0 ? all : std::min(all, most);
}

}  // namespace

void limit_threads(unsigned most) noexcept { most_threads = most; }

void run_parallel(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) {
  const std::size_t chunk = std::clamp<std::size_t>(count / 64, 1, 1024);  // balances rooms against walls
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto loop = [&] {
    try {
      for (std::size_t begin; (begin = next.fetch_add(chunk)) < count;) work(begin, std::min(begin + chunk, count));
    } catch (...) {
      const std::lock_guard lock(failure_mutex);
      failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 1, most = thread_count(); i < most; ++i) threads.emplace_back(loop);
    loop();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace backwash

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

namespace study_worlds {

/// Runs `task(k, folder)` for k below `count` on `jobs` threads, each with a folder of its own that is removed at the
/// end.
template <typename Task>
void in_parallel(int jobs, std::size_t count, Task task) {
  std::atomic<std::size_t> next = 0;
  std::vector<std::jthread> threads;
  for (int j = 0; j < jobs; ++j)
    threads.emplace_back([&, j] {
      const auto folder = std::filesystem::temp_directory_path() /
                          ("study-worlds-" + std::to_string(::getpid()) + "-" + std::to_string(j));
      for (std::size_t k = next++; k < count; k = next++) task(k, folder);
      std::filesystem::remove_all(folder);
    });
}

}  // namespace study_worlds

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>

namespace backwash {

/// Runs `work(begin, end)` over disjoint ranges that cover [0, count), possibly from several threads, and returns when
/// all are done. core itself knows no threads: services pass their own.
using Parallel = std::function<void(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work)>;
inline void run_serial(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) { work(0, count); }

}  // namespace backwash

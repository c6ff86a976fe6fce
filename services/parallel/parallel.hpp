// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>

namespace backwash {

/// run_parallel takes no more threads than this from now on; 0: all processors.
void limit_threads(unsigned most) noexcept;

/// Parallel on all processors. What `work` throws is thrown again here, once.
void run_parallel(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work);

}  // namespace backwash

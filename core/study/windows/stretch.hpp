// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/study/windows/series.hpp"

namespace backwash::study {

inline constexpr double kWindow = 2.0;      ///< s
inline constexpr std::size_t kFewest = 20;  ///< samples of a window

/// Samples begin … end − 1.
struct Stretch {
  std::size_t begin, end;
  std::size_t size() const { return end - begin; }
};

/// Windows of 2 s (to the nearest whole number in each run of rows without a gap and of one segment).
std::vector<Stretch> cut(const Series& s);

}  // namespace backwash::study

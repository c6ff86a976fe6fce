// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/stretch.hpp"

#include <cmath>

#include "core/study/windows/gates/gates.hpp"

namespace backwash::study {

std::vector<SampleRange> cut(const Series& s) {
  constexpr double kLength = kWindowRules.window_length;
  constexpr auto kFewest = static_cast<std::size_t>(kWindowRules.fewest_rows);
  std::vector<SampleRange> windows;
  for (const auto& [from, to] : unbroken(s.t, {}))
    for (std::size_t begin = from; begin < to;) {
      std::size_t end = begin + 1;
      while (end < to && s.segment[end] == s.segment[begin]) ++end;
      const double length = s.t[end - 1] - s.t[begin];
      const double most = static_cast<double>(end - begin) / (kFewest - 1);  // of parts that hold enough samples
      const auto parts = static_cast<std::size_t>(std::lround(length / kLength < most ? length / kLength : 0.0));
      for (std::size_t k = 0; k < parts; ++k) {
        const std::size_t a = begin + k * (end - begin) / parts, b = begin + (k + 1) * (end - begin) / parts;
        if (b - a >= kFewest) windows.push_back({a, b});
      }
      begin = end;
    }
  return windows;
}

}  // namespace backwash::study

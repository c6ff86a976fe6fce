// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/stretch.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::study {

std::vector<Stretch> cut(const Series& s) {
  std::vector<double> spacing;
  for (std::size_t i = 1; i < s.size(); ++i) spacing.push_back(s.t[i] - s.t[i - 1]);
  std::nth_element(spacing.begin(), spacing.begin() + static_cast<std::ptrdiff_t>(spacing.size() / 2), spacing.end());
  const double longest = std::max(0.1, 5 * spacing[spacing.size() / 2]);
  std::vector<Stretch> windows;
  for (std::size_t begin = 0; begin < s.size();) {
    std::size_t end = begin + 1;
    while (end < s.size() && s.segment[end] == s.segment[begin] && s.t[end] - s.t[end - 1] <= longest) ++end;
    const double length = s.t[end - 1] - s.t[begin];
    const double most = static_cast<double>(end - begin) / (kFewest - 1);  // of parts that hold enough samples
    const auto parts = static_cast<std::size_t>(std::lround(length / kWindow < most ? length / kWindow : 0.0));
    for (std::size_t k = 0; k < parts; ++k) {
      const std::size_t a = begin + k * (end - begin) / parts, b = begin + (k + 1) * (end - begin) / parts;
      if (b - a >= kFewest) windows.push_back({a, b});
    }
    begin = end;
  }
  return windows;
}

}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/same_gusts.hpp"

#include <cmath>

#include "core/study/windows/window_rules.hpp"

namespace backwash::study {
namespace {

/// Correlation of two flights' ln variances, each axis about its own mean; 0 where too few can be compared.
double likeness(const Observations& seen, std::size_t a, std::size_t b) {
  double xx = 0, yy = 0, xy = 0;
  std::size_t count = 0;
  for (const Channel c : {kVarX, kVarY, kVarZ}) {
    std::vector<std::pair<double, double>> pairs;
    double mean_x = 0, mean_y = 0;
    std::size_t j = seen.first[b];
    for (std::size_t i = seen.first[a]; i < seen.first[a + 1]; ++i) {
      const double near = kWindowRules.same_time * seen.windows[i].duration;
      while (j < seen.first[b + 1] && seen.windows[j].t < seen.windows[i].t - near) ++j;
      if (j == seen.first[b + 1]) break;
      if (seen.windows[j].t > seen.windows[i].t + near) continue;
      if (!(seen.weight[c][i] > 0 && seen.weight[c][j] > 0)) continue;
      pairs.emplace_back(seen.y[c][i], seen.y[c][j]);
      mean_x += seen.y[c][i], mean_y += seen.y[c][j];
    }
    const double n = static_cast<double>(pairs.size());
    for (const auto& [x, y] : pairs) {
      xx += std::pow(x - mean_x / n, 2), yy += std::pow(y - mean_y / n, 2);
      xy += (x - mean_x / n) * (y - mean_y / n);
    }
    count += pairs.size();
  }
  return static_cast<double>(count) >= kWindowRules.same_windows && xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : 0;
}

}  // namespace

std::vector<std::size_t> same_gusts(const Observations& seen) {
  std::vector<std::size_t> same(seen.flights);
  for (std::size_t f = 0; f < seen.flights; ++f) {
    same[f] = f;
    for (std::size_t g = 0; g < f && same[f] == f; ++g)
      if (same[g] == g && likeness(seen, f, g) >= kWindowRules.same_gusts) same[f] = g;
  }
  return same;
}

}  // namespace backwash::study

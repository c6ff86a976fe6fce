// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/same_gusts.hpp"

#include <cmath>
#include <utility>

#include "core/study/windows/window_rules.hpp"

namespace backwash::study {
namespace {

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// Windows of two flights at the same time since take-off.
void pair_windows(const Gusts& a, const Gusts& b, Pairs& pairs) {
  pairs.clear();
  for (std::size_t i = 0, j = 0; i < a.t.size(); ++i) {
    while (j < b.t.size() && b.t[j] < a.t[i] - a.near[i]) ++j;
    if (j == b.t.size()) return;
    if (b.t[j] <= a.t[i] + a.near[i]) pairs.emplace_back(i, j);
  }
}

/// Correlation of two flights' ln variances, each axis about its own mean; 0 where too few can be compared.
double likeness(const Gusts& a, const Gusts& b, const Pairs& pairs) {
  double xx = 0, yy = 0, xy = 0;
  std::size_t count = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    double mean_x = 0, mean_y = 0;
    std::size_t own = 0;
    const auto measured = [&](auto& at) { return a.weight[c][at.first] > 0 && b.weight[c][at.second] > 0; };
    for (const auto& at : pairs)
      if (measured(at)) mean_x += a.y[c][at.first], mean_y += b.y[c][at.second], ++own;
    const double n = static_cast<double>(own);
    for (const auto& at : pairs) {
      if (!measured(at)) continue;
      const double x = a.y[c][at.first], y = b.y[c][at.second];
      xx += std::pow(x - mean_x / n, 2), yy += std::pow(y - mean_y / n, 2);
      xy += (x - mean_x / n) * (y - mean_y / n);
    }
    count += own;
  }
  return static_cast<double>(count) >= kWindowRules.same_windows && xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : 0;
}

}  // namespace

Gusts gusts_of(const Observations& seen, std::size_t flight) {
  Gusts gusts;
  for (std::size_t i = seen.first[flight]; i < seen.first[flight + 1]; ++i) {
    gusts.t.push_back(seen.windows[i].t), gusts.near.push_back(kWindowRules.same_time * seen.windows[i].duration);
    for (std::size_t k = 0; k < 3; ++k)
      gusts.y[k].push_back(seen.y[kVarX + k][i]), gusts.weight[k].push_back(seen.weight[kVarX + k][i]);
  }
  return gusts;
}

std::vector<std::size_t> same_gusts(const std::vector<Gusts>& flights) {
  std::vector<std::size_t> same(flights.size());
  Pairs pairs;
  for (std::size_t f = 0; f < same.size(); ++f) {
    same[f] = f;
    for (std::size_t g = 0; g < f && same[f] == f; ++g) {
      if (same[g] != g) continue;
      pair_windows(flights[f], flights[g], pairs);
      if (likeness(flights[f], flights[g], pairs) >= kWindowRules.same_gusts) same[f] = g;
    }
  }
  return same;
}

std::vector<std::size_t> same_gusts(const Observations& seen) {
  std::vector<Gusts> flights;
  for (std::size_t f = 0; f < seen.flights; ++f) flights.push_back(gusts_of(seen, f));
  return same_gusts(flights);
}

}  // namespace backwash::study

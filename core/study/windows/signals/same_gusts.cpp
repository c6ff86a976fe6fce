// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/signals/same_gusts.hpp"

#include <cmath>
#include <utility>

#include "core/study/windows/gates/window_rules.hpp"

namespace backwash::study {
namespace {

/// Sums of one axis over the windows that two flights share, of values less their flight's own mean: what is squared is
/// no larger than what it is to tell.
struct Shared {
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
};

/// Correlation of two flights' ln variances over their windows at the same time since take-off, each axis about its own
/// mean; 0 where too few can be compared.
double likeness(const Gusts& a, const Gusts& b) {
  std::array<Shared, 3> axes{};
  for (std::size_t i = 0, j = 0; i < a.t.size(); ++i) {
    while (j < b.t.size() && b.t[j] < a.t[i] - a.near[i]) ++j;
    if (j == b.t.size()) break;
    if (b.t[j] > a.t[i] + a.near[i]) continue;
    for (std::size_t c = 0; c < axes.size(); ++c) {
      if (!(a.weight[c][i] > 0 && b.weight[c][j] > 0)) continue;
      const double x = a.y[c][i], y = b.y[c][j];
      Shared& s = axes[c];
      s.n += 1;
      s.x += x;
      s.y += y;
      s.xx += x * x;
      s.yy += y * y;
      s.xy += x * y;
    }
  }
  double n = 0, xx = 0, yy = 0, xy = 0;
  for (const Shared& s : axes) {
    if (s.n == 0) continue;
    n += s.n;
    xx += s.xx - s.x * s.x / s.n;
    yy += s.yy - s.y * s.y / s.n;
    xy += s.xy - s.x * s.y / s.n;
  }
  return n >= kWindowRules.same_windows && xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : 0;
}

/// Less the mean of what was measured, per axis.
void centre(Gusts& gusts) {
  for (std::size_t c = 0; c < gusts.y.size(); ++c) {
    double sum = 0, n = 0;
    for (std::size_t i = 0; i < gusts.t.size(); ++i)
      if (gusts.weight[c][i] > 0) {
        sum += gusts.y[c][i];
        n += 1;
      }
    for (double& y : gusts.y[c]) y -= n > 0 ? sum / n : 0;
  }
}

}  // namespace

Gusts gusts_of(const Observations& seen, std::size_t flight) {
  Gusts gusts;
  for (std::size_t i = seen.first[flight]; i < seen.first[flight + 1]; ++i) {
    gusts.t.push_back(seen.windows[i].t);
    gusts.near.push_back(kWindowRules.same_time * seen.windows[i].duration);
    for (std::size_t k = 0; k < 3; ++k) {
      gusts.y[k].push_back(seen.y[kVarX + k][i]);
      gusts.weight[k].push_back(seen.weight[kVarX + k][i]);
    }
  }
  return gusts;
}

std::vector<std::size_t> same_gusts(std::vector<Gusts> flights) {
  for (Gusts& own : flights) centre(own);
  std::vector<std::size_t> same(flights.size());
  for (std::size_t f = 0; f < same.size(); ++f) {
    same[f] = f;
    for (std::size_t g = 0; g < f && same[f] == f; ++g) {
      if (same[g] == g && likeness(flights[f], flights[g]) >= kWindowRules.same_gusts) same[f] = g;
    }
  }
  return same;
}

}  // namespace backwash::study

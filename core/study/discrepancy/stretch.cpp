// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/discrepancy/stretch.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::study::discrepancy {

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
    const auto parts = static_cast<std::size_t>(std::lround(length / kWindow));
    for (std::size_t k = 0; k < parts; ++k) {
      const std::size_t a = begin + k * (end - begin) / parts, b = begin + (k + 1) * (end - begin) / parts;
      if (b - a >= kFewest) windows.push_back({a, b});
    }
    begin = end;
  }
  return windows;
}

const char* gate(const Series& s, const FlightLog& log, Stretch w) {
  std::size_t repeated = 0, full = 0;
  for (std::size_t i = w.begin + 1; i < w.end; ++i)
    repeated += s.p[i] == s.p[i - 1] && s.a[i] == s.a[i - 1] && s.v[i] == s.v[i - 1] ? 1u : 0u;
  if (20 * repeated > w.size()) return "frozen";
  Vec3 low = s.p[w.begin], high = low;
  double thrust = 0;
  for (std::size_t i = w.begin; i < w.end; ++i) {
    low = low.cwiseMin(s.p[i]), high = high.cwiseMax(s.p[i]);
    if (!s.thrust_acc.empty()) thrust += s.thrust_acc[i] / static_cast<double>(w.size());
  }
  if ((high - low).maxCoeff() < 5e-4 || (!s.thrust_acc.empty() && thrust < 0.6 * kGravity)) return "perched";
  if (log.has("thrust"))
    for (std::size_t i = w.begin; i < w.end; ++i) full += log.column("thrust")[i] >= 0.99 ? 1u : 0u;
  if (50 * full > w.size()) return "saturated";
  if (s.has_velocity) {  // position and velocity must tell the same story
    const double time = s.t[w.end - 1] - s.t[w.begin];
    Vec3 flown = Vec3::Zero();
    for (std::size_t i = w.begin + 1; i < w.end; ++i) flown += 0.5 * (s.v[i] + s.v[i - 1]) * (s.t[i] - s.t[i - 1]);
    if (((s.p[w.end - 1] - s.p[w.begin] - flown) / time).norm() > 0.15) return "inconsistent";
  }
  return nullptr;
}

}  // namespace backwash::study::discrepancy

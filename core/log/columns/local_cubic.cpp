// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/local_cubic.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>

namespace backwash::log {
namespace {

constexpr double kHalfWidth = 0.12;  // s
constexpr std::size_t kLeastRows = 6;

/// Through the rows [first, last) around time `at`.
LocalMotion cubic(const std::vector<double>& t, const std::vector<Vec3>& p, std::size_t first, std::size_t last,
                  double at) {
  std::array<double, 7> sum{};  // of powers of u: the normal equations' entry (i, k) is that of u^(i + k)
  Eigen::Matrix<double, 3, 4> right = Eigen::Matrix<double, 3, 4>::Zero();
  for (std::size_t i = first; i < last; ++i) {
    double power = 1;
    const double u = (t[i] - at) / kHalfWidth;
    for (std::size_t k = 0; k < sum.size(); ++k, power *= u) {
      sum[k] += power;
      if (k < 4) right.col(static_cast<Eigen::Index>(k)) += power * p[i];
    }
  }
  const Eigen::Matrix4d normal = Eigen::Matrix4d::NullaryExpr(
      [&](Eigen::Index i, Eigen::Index k) { return sum[static_cast<std::size_t>(i + k)]; });
  const Eigen::Matrix<double, 4, 3> c = normal.llt().solve(right.transpose());
  return {c.row(1) / kHalfWidth, 2 * c.row(2) / (kHalfWidth * kHalfWidth)};
}

}  // namespace

std::vector<std::optional<LocalMotion>> local_cubics(const std::vector<double>& t, const std::vector<Vec3>& p) {
  std::vector<std::optional<LocalMotion>> motion(t.size());
  std::size_t first = 0, last = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    while (t[first] < t[i] - kHalfWidth - 1e-9) ++first;
    while (last < t.size() && t[last] <= t[i] + kHalfWidth + 1e-9) ++last;
    const bool both_sides = t[i] - t[first] > 0.5 * kHalfWidth && t[last - 1] - t[i] > 0.5 * kHalfWidth;
    if (last - first >= kLeastRows && both_sides) motion[i] = cubic(t, p, first, last, t[i]);
  }
  return motion;
}

std::vector<Hold> holds(const std::vector<double>& t, const std::vector<Vec3>& p) {
  std::vector<Hold> all;
  for (std::size_t first = 0, next = 0; first < t.size(); first = next) {
    for (next = first + 1; next < t.size() && p[next] == p[first];) ++next;
    if (t[std::min(next, t.size() - 1)] - t[first] > 2 * kHalfWidth) all.push_back({first, next});
  }
  return all;
}

std::vector<std::optional<LocalMotion>> local_cubics_but_for_holds(const std::vector<double>& t,
                                                                   const std::vector<Vec3>& p) {
  auto motion = local_cubics(t, p);
  for (const auto& [first, next] : holds(t, p)) {
    const auto from = std::lower_bound(t.begin(), t.end(), t[first] - kHalfWidth);
    const auto to = std::upper_bound(t.begin(), t.end(), t[std::min(next, t.size() - 1)] + kHalfWidth);
    std::fill(motion.begin() + (from - t.begin()), motion.begin() + (to - t.begin()), std::nullopt);
  }
  return motion;
}

}  // namespace backwash::log

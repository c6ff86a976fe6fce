// SPDX-License-Identifier: BSD-3-Clause
#include "tests/promises/separation.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace backwash::promises {

std::vector<Vec3> prism_corners(const Vec3& center_W, const PerDirection& half_widths) {
  std::vector<Vec3> corners;
  constexpr Direction kSides[] = {kX, kXyPlus, kY, kXyMinus};
  for (int a = 0; a < 8; ++a)
    for (int b = a + 1; b < 8; ++b) {
      Eigen::Matrix2d sides;
      sides << (a < 4 ? 1 : -1) * unit(kSides[a % 4]).head<2>().transpose(),
          (b < 4 ? 1 : -1) * unit(kSides[b % 4]).head<2>().transpose();
      if (a % 4 == b % 4) continue;
      const Eigen::Vector2d at =
          sides.inverse() * Eigen::Vector2d(half_widths[kSides[a % 4]], half_widths[kSides[b % 4]]);
      const bool within = std::ranges::all_of(
          kSides, [&](Direction d) { return std::abs(unit(d).head<2>().dot(at)) <= half_widths[d] + 1e-12; });
      if (!within) continue;
      for (const double z : {-half_widths[kZ], half_widths[kZ]}) corners.push_back(center_W + Vec3(at.x(), at.y(), z));
    }
  return corners;
}

namespace {

/// The point of least norm on the affine hull of some points, as weights; empty if they depend on one another.
Eigen::VectorXd nearest_of_affine(const std::vector<Vec3>& points) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd system = Eigen::MatrixXd::Ones(n + 1, n + 1);
  system(n, n) = 0;
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      system(i, j) = points[static_cast<std::size_t>(i)].dot(points[static_cast<std::size_t>(j)]);
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(system);
  if (!lu.isInvertible()) return {};
  return lu.solve(Eigen::VectorXd::Unit(n + 1, n)).head(n);
}

}  // namespace

double hull_to_box(const std::vector<Vec3>& hull, const Vec3& low, const Vec3& high) {
  // The corner of hull − box farthest against x.
  const auto farthest = [&](const Vec3& x) {
    const Vec3* least = &hull.front();
    for (const Vec3& p : hull)
      if (p.dot(x) < least->dot(x)) least = &p;
    Vec3 box;
    for (int axis = 0; axis < 3; ++axis) box[axis] = x[axis] > 0 ? high[axis] : low[axis];
    return Vec3(*least - box);
  };
  std::vector<Vec3> kept{hull.front() - low};
  std::vector<double> weight{1};
  Vec3 x = kept.front();
  for (int round = 0; round < 200; ++round) {
    const double norm = x.norm();
    if (norm < 1e-9) return 0;
    const Vec3 next = farthest(x);
    if (norm - next.dot(x) / norm < 1e-10) return norm;  // no plane lies farther
    kept.push_back(next);
    weight.push_back(0);
    for (;;) {
      const Eigen::VectorXd to = nearest_of_affine(kept);
      if (to.size() == 0) return std::max(0.0, next.dot(x) / norm);  // rounding: a distance that surely is
      double share = 1;
      for (std::size_t i = 0; i < kept.size(); ++i) {
        const double at = to[static_cast<Eigen::Index>(i)];
        if (at < 0) share = std::min(share, weight[i] / (weight[i] - at));
      }
      for (std::size_t i = 0; i < kept.size(); ++i) weight[i] += share * (to[static_cast<Eigen::Index>(i)] - weight[i]);
      if (share >= 1) break;
      for (std::size_t i = kept.size(); i-- > 0;)
        if (weight[i] <= 1e-14) {
          kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(i));
          weight.erase(weight.begin() + static_cast<std::ptrdiff_t>(i));
        }
    }
    x.setZero();
    for (std::size_t i = 0; i < kept.size(); ++i) x += weight[i] * kept[i];
  }
  return std::max(0.0, farthest(x).dot(x) / x.norm());
}

Obstacles::Obstacles(const map::OccupancyGrid& grid) : edge_(grid.resolution()) {
  const Index3& size = grid.size();
  for (int k = -1; k <= size.z(); ++k)
    for (int j = -1; j <= size.y(); ++j)
      for (int i = -1; i <= size.x(); ++i) {
        const Index3 v(i, j, k);
        if (grid.free(v)) continue;
        bool exposed = false;
        for (int axis = 0; axis < 3; ++axis)
          exposed |= grid.free(v + Index3::Unit(axis)) || grid.free(v - Index3::Unit(axis));
        if (exposed) low_.push_back(grid.origin() + edge_ * v.cast<double>());
      }
}

double Obstacles::distance(const std::vector<Vec3>& hull, double limit) const {
  Vec3 low = hull.front(), high = low;
  for (const Vec3& p : hull) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  double nearest = limit;
  for (const Vec3& corner : low_) {
    const Vec3 gap = (corner - high).cwiseMax(low - corner - Vec3::Constant(edge_)).cwiseMax(0.0);
    if (gap.squaredNorm() >= nearest * nearest) continue;
    nearest = std::min(nearest, hull_to_box(hull, corner, corner + Vec3::Constant(edge_)));
  }
  return nearest;
}

}  // namespace backwash::promises

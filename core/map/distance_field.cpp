// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/distance_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/map/distance_transform.hpp"
#include "core/map/lattice.hpp"

namespace backwash::map {
namespace {

double mix(double a, double b, double t) noexcept { return a + (b - a) * t; }

/// Gap between coordinate q and the interval [i, i + 1].
double gap(double q, int i) noexcept { return std::max({i - q, q - (i + 1), 0.0}); }

}  // namespace

DistanceField::DistanceField(const OccupancyGrid& grid)
    : origin_W_(grid.origin()),
      resolution_(grid.resolution()),
      half_voxel_(0.5 * grid.resolution()),
      squared_(grid.size()) {
  transform_distances(grid, all_of(grid.size()), squared_);
}

void DistanceField::update(const OccupancyGrid& grid, const VoxelBox& changed) {
  if (changed.empty()) return;
  const Index3 around = Index3::Constant(most_steps(grid.size()));
  const Index3 low = (changed.low - around).cwiseMax(0),
               high = (changed.high + around).cwiseMin(grid.size() - Index3::Ones());
  // Half voxels between a voxel's centre and the box along an axis.
  const auto gap2 = [&](int axis, int i) {
    const int gap = std::max({0, 2 * (changed.low[axis] - i) - 1, 2 * (i - changed.high[axis]) - 1});
    return gap * gap;
  };
  VoxelBox affected;
  for (int k = low.z(); k <= high.z(); ++k)
    for (int j = low.y(); j <= high.y(); ++j) {
      const int beside = gap2(2, k) + gap2(1, j);
      const std::uint16_t* const row = squared_.row(j, k);
      const auto reached = [&](int i) { return beside + gap2(0, i) <= row[i]; };
      int first = low.x(), last = high.x();
      while (first <= last && !reached(first)) ++first;
      while (first < last && !reached(last)) --last;
      if (first <= last) {
        affected.add({first, j, k});
        affected.add({last, j, k});
      }
    }
  if (affected.empty()) return;
  squared_.own(affected);
  transform_distances(grid, affected, squared_);
}

bool DistanceField::covers(const Vec3& q) const noexcept {
  return (q.array() >= 0.0).all() && (q.array() < squared_.size().cast<double>().array()).all();  // false for NaN
}

DistanceField::Corners DistanceField::corners(const Vec3& q) const noexcept {
  const Vec3 floor = (q.array() - 0.5).floor();
  const Index3 base = floor.cast<int>();
  Corners c{{}, q - Vec3::Constant(0.5) - floor};
  const bool within = inside(squared_.size(), base) && inside(squared_.size(), base + Index3::Ones());
  for (int row = 0; row < 4; ++row) {
    const Index3 v = base + Index3(0, row & 1, row >> 1);
    const auto n = static_cast<std::size_t>(2 * row);
    if (within) {
      const std::uint16_t* const cells = squared_.row(v.y(), v.z()) + v.x();
      c.d[n] = metres(cells[0]);
      c.d[n + 1] = metres(cells[1]);
    } else {
      c.d[n] = at(v);
      c.d[n + 1] = at(v + Index3::UnitX());
    }
  }
  return c;
}

double DistanceField::interpolated(const Vec3& p_W) const noexcept {
  const Vec3 q = (p_W - origin_W_) / resolution_;
  if (!covers(q)) return 0.0;
  const auto [d, t] = corners(q);
  return mix(mix(mix(d[0], d[1], t.x()), mix(d[2], d[3], t.x()), t.y()),
             mix(mix(d[4], d[5], t.x()), mix(d[6], d[7], t.x()), t.y()), t.z());
}

DistanceField::Linear DistanceField::linear(const Vec3& p_W) const noexcept {
  const Vec3 q = (p_W - origin_W_) / resolution_;
  if (!covers(q)) return {0.0, Vec3::Zero()};
  const auto [d, t] = corners(q);
  const double a = mix(d[0], d[1], t.x()), b = mix(d[2], d[3], t.x()), c = mix(d[4], d[5], t.x()),
               e = mix(d[6], d[7], t.x());
  const Vec3 per_voxel(mix(mix(d[1] - d[0], d[3] - d[2], t.y()), mix(d[5] - d[4], d[7] - d[6], t.y()), t.z()),
                       mix(mix(d[2] - d[0], d[3] - d[1], t.x()), mix(d[6] - d[4], d[7] - d[5], t.x()), t.z()),
                       mix(mix(d[4] - d[0], d[5] - d[1], t.x()), mix(d[6] - d[2], d[7] - d[3], t.x()), t.y()));
  return {mix(mix(a, b, t.y()), mix(c, e, t.y()), t.z()), per_voxel / resolution_};
}

double DistanceField::exact(const OccupancyGrid& grid, const Vec3& p_W) const noexcept {
  const Vec3 q = (p_W - origin_W_) / resolution_;  // from here on in voxels
  if (!covers(q)) return 0.0;
  const Index3 v = q.array().floor().cast<int>();
  if (!grid.free(v)) return 0.0;

  // The distance is 1-Lipschitz, so at() bounds the search; the surplus covers the rounding of the stored float.
  const double reach = at(v) / resolution_ + (q - v.cast<double>() - Vec3::Constant(0.5)).norm();
  double best = std::min({q.minCoeff(), (grid.size().cast<double>() - q).minCoeff(), reach * (1 + 1e-6)});
  best *= best;
  const double radius = std::sqrt(best);
  const Index3 low = (q.array() - radius).floor().cast<int>().max(0);
  const Index3 high = (q.array() + radius).floor().cast<int>().min(grid.size().array() - 1);
  for (int k = low.z(); k <= high.z(); ++k) {
    const double dz = gap(q.z(), k);
    for (int j = low.y(); j <= high.y(); ++j) {
      const double dy = gap(q.y(), j);
      const double off_row = dz * dz + dy * dy;
      if (off_row >= best) continue;
      for (int i = low.x(); i <= high.x();) {
        if (!grid.free({i, j, k})) {
          const double dx = gap(q.x(), i);
          best = std::min(best, off_row + dx * dx);
          ++i;
        } else {  // an obstacle n voxels along the row is n − 1/2 away from this centre: none before that
          i += std::max(1, static_cast<int>(std::ceil(at({i, j, k}) / resolution_ + 0.5 - 1e-3)));
        }
      }
    }
  }
  return std::sqrt(best) * resolution_;
}

}  // namespace backwash::map

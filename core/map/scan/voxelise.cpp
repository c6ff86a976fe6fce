// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/scan/voxelise.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/map/lattice_box.hpp"

namespace backwash::map {
namespace {

/// Whether the projections of triangle and cube on `axis` are apart.
bool apart(const Triangle& from_center, const Vec3& axis, double half) noexcept {
  const double p0 = axis.dot(from_center[0]), p1 = axis.dot(from_center[1]), p2 = axis.dot(from_center[2]);
  const double reach = half * axis.cwiseAbs().sum();
  return std::min({p0, p1, p2}) > reach || std::max({p0, p1, p2}) < -reach;
}

Triangle in_voxels(const OccupancyGrid& grid, const Triangle& triangle_W) noexcept {
  Triangle q;
  for (std::size_t n = 0; n < 3; ++n) q[n] = (triangle_W[n] - grid.origin()) / grid.resolution();
  return q;
}

/// Occupies the voxels from `low` on, `edge` (a power of two) along each axis, that are in the box and meet the
/// triangle.
void occupy(OccupancyGrid& grid, const Triangle& q, const Index3& first, const Index3& last, const Index3& low,
            int edge) {
  if ((low.array() > last.array()).any() || (low.array() + edge <= first.array()).any()) return;
  const double half = 0.5 * edge;
  if (!meets_cube(q, low.cast<double>().array() + half, half + kOnFace)) return;
  if (edge == 1) return grid.set(low, Cell::occupied);
  for (int n = 0; n < 8; ++n)
    occupy(grid, q, first, last, low + edge / 2 * Index3(n & 1, n >> 1 & 1, n >> 2), edge / 2);
}

}  // namespace

bool meets_cube(const Triangle& triangle, const Vec3& center, double half) noexcept {
  const Triangle v = {triangle[0] - center, triangle[1] - center, triangle[2] - center};
  for (int axis = 0; axis < 3; ++axis)
    if (apart(v, Vec3::Unit(axis), half)) return false;
  const std::array<Vec3, 3> edges = {v[1] - v[0], v[2] - v[1], v[0] - v[2]};
  if (apart(v, edges[0].cross(edges[1]), half)) return false;
  for (const Vec3& edge : edges)
    for (int axis = 0; axis < 3; ++axis)
      if (apart(v, Vec3::Unit(axis).cross(edge), half)) return false;
  return true;
}

void add_triangle(OccupancyGrid& grid, const Triangle& triangle_W) {
  const Triangle q = in_voxels(grid, triangle_W);
  const Vec3 size = grid.size().cast<double>();
  const Vec3 low = q[0].cwiseMin(q[1]).cwiseMin(q[2]).array() - kOnFace;
  const Vec3 high = q[0].cwiseMax(q[1]).cwiseMax(q[2]).array() + kOnFace;
  if ((high.array() < 0).any() || (low.array() >= size.array()).any()) return;
  const Index3 first = low.cwiseMax(0).array().floor().cast<int>();
  const Index3 last = high.array().floor().min(size.array() - 1).cast<int>();
  const auto widest = static_cast<unsigned>((last - first).maxCoeff() + 1);
  occupy(grid, q, first, last, first, static_cast<int>(std::bit_ceil(widest)));
}

bool on_faces(const OccupancyGrid& grid, const Triangle& triangle_W) noexcept {
  const Triangle q = in_voxels(grid, triangle_W);
  for (int axis = 0; axis < 3; ++axis) {
    const double face = std::round(q[0][axis]);
    if (std::ranges::all_of(q, [&](const Vec3& corner) { return std::abs(corner[axis] - face) <= kOnFace; }))
      return true;
  }
  return false;
}

std::size_t add_points(OccupancyGrid& grid, std::span<const Vec3> points_W, unsigned least) {
  std::vector<std::uint16_t> counts(least > 1 ? grid.cell_count() : 0);
  std::size_t inside = 0;
  for (const Vec3& p : points_W) {
    const Vec3 q = (p - grid.origin()) / grid.resolution();
    if (!((q.array() >= 0).all() && (q.array() < grid.size().cast<double>().array()).all())) continue;
    ++inside;
    const Index3 v = q.array().floor().cast<int>();
    if (counts.empty()) {
      grid.set(v, Cell::occupied);
    } else if (auto& count = counts[grid.linear(v)]; count < std::numeric_limits<std::uint16_t>::max()) {
      if (++count >= least) grid.set(v, Cell::occupied);
    }
  }
  return inside;
}

}  // namespace backwash::map

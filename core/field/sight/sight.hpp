// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/map/occupancy_grid.hpp"

namespace backwash::field {

/// Tolerance of "meets a closed box", voxel edges: a line through exactly an edge or a corner stays blocked under
/// rounding (the rounding of a coordinate 1 km from the origin is 1e-12 of an edge).
inline constexpr double kTouch = 1e-7;

/// Line segment in voxel units: voxel (i, j, k) is the box [i, i+1] × [j, j+1] × [k, k+1].
struct LineSegment {
  Vec3 from, delta;
};

/// Largest integer ≤ x, for |x| < 2³¹; std::floor is a library call without SSE 4.1.
inline int floor_to_int(double x) noexcept {
  const int i = static_cast<int>(x);
  return i - (x < i ? 1 : 0);
}
/// Smallest integer ≥ x.
inline int ceil_to_int(double x) noexcept { return -floor_to_int(-x); }

/// The segment from p to c without its last 2a (docs/model.md section 1, "Visible"), in voxel units; nothing when |c −
/// p| ≤ 2a.
std::optional<LineSegment> open_part(const Vec3& origin_W, double voxel_edge, const Vec3& p_W,
                                     const Vec3& c_W) noexcept;

/// Whether the line meets the closed box of a voxel, with the tolerance kTouch: the slab test.
bool meets(const LineSegment& line, const Index3& voxel) noexcept;

/// clear() for a line whose dominant axis is u: fixed at compile time, the march stays in registers.
template <int u, typename EmptyRadius>
bool clear_along(const LineSegment& line, const EmptyRadius& empty_radius, int empty_start) noexcept {
  constexpr int v = (u + 1) % 3, w = (u + 2) % 3;
  constexpr double kReach = 2 * kTouch;    // candidates reach further than meets(), so that rounding loses none
  constexpr double kStep = 0.01 * kTouch;  // past a slab's end, so that the next cell is in the next slab
  const double length = std::abs(line.delta[u]);
  const double inverse = length > 0 ? 1 / length : 0;
  const bool upward = line.delta[u] >= 0;
  const double direction = upward ? 1 : -1, slope_v = line.delta[v] * inverse, slope_w = line.delta[w] * inverse;
  const double end = length + kReach;
  Index3 cell;
  for (double s = std::max(empty_start - 1, 0) - kReach; s <= end;) {
    const double x = line.from[u] + s * direction;
    const double y = line.from[v] + s * slope_v, z = line.from[w] + s * slope_w;
    cell[u] = floor_to_int(x);
    cell[v] = floor_to_int(y);
    cell[w] = floor_to_int(z);
    if (const int radius = empty_radius(cell); radius > 1) {
      s += radius - 1 - kReach;
      continue;
    }
    double piece = upward ? cell[u] + 1 - x : x - cell[u];
    int u0 = cell[u], u1 = cell[u];
    if (piece < kReach) {
      piece += 1;
      (upward ? ++u1 : --u0);
    }  // grazes the slab's end: take it with the next slab
    const double y1 = y + piece * slope_v, z1 = z + piece * slope_w;
    const int v0 = floor_to_int(std::min(y, y1) - kReach), v1 = floor_to_int(std::max(y, y1) + kReach);
    const int w0 = floor_to_int(std::min(z, z1) - kReach), w1 = floor_to_int(std::max(z, z1) + kReach);
    for (cell[u] = u0; cell[u] <= u1; ++cell[u])
      for (cell[v] = v0; cell[v] <= v1; ++cell[v])
        for (cell[w] = w0; cell[w] <= w1; ++cell[w])
          if (empty_radius(cell) == 0 && meets(line, cell)) return false;
    s += piece + kStep;
  }
  return true;
}

/// Whether a line meets no occupied voxel. `empty_radius(v)`: 0 at an occupied voxel, else r ≥ 1 such that no voxel
/// nearer than r in the Chebyshev distance is occupied; r = 1 everywhere free is correct, a larger r is faster.
///
/// Marches along the dominant axis. From a point in a voxel of radius r, the next r − 1 are empty: jump. Near occupied
/// voxels (r ≤ 1) it goes slab by slab of unit thickness: the voxels that the piece in a slab can touch lie in its
/// bounding rectangle in the other two axes, one to four of them, and only an occupied one is tested exactly.
/// `empty_start`: empty_radius of the voxel of line.from if known, else 0.
template <typename EmptyRadius>
bool clear(const LineSegment& line, const EmptyRadius& empty_radius, int empty_start = 0) noexcept {
  const Vec3 extent = line.delta.cwiseAbs();
  if (extent.x() >= extent.y() && extent.x() >= extent.z()) return clear_along<0>(line, empty_radius, empty_start);
  return extent.y() >= extent.z() ? clear_along<1>(line, empty_radius, empty_start)
                                  : clear_along<2>(line, empty_radius, empty_start);
}

/// A copy of a grid's occupied voxels made for fast lines of sight: the Chebyshev distance from each voxel to the
/// nearest occupied one, one byte each, and summed-area counts, four bytes each. Thread-safe.
class SightMap {
 public:
  /// O(cells).
  explicit SightMap(const map::OccupancyGrid& grid);

  /// A point to look from, with what all lines from it share.
  struct Viewpoint {
    Vec3 p_W;
    int empty_radius;
  };
  Viewpoint viewpoint(const Vec3& p_W) const noexcept;
  /// Whether the segment from p to c, its last 2a left out, meets no occupied voxel (docs/model.md section 1,
  /// "Visible"). Voxels are closed boxes: a segment through exactly an edge or a corner is blocked if any voxel that
  /// touches that point is occupied. Unknown voxels do not block. Does not test the normal. Three or four jumps for a
  /// line across a room.
  bool line_of_sight(const Viewpoint& from, const Vec3& c_W) const noexcept;

  /// The line from a viewpoint to c without its end, in voxel units; nothing when it is all end.
  std::optional<LineSegment> open_part(const Viewpoint& from, const Vec3& c_W) const noexcept {
    return field::open_part(origin_W_, resolution_, from.p_W, c_W);
  }
  /// As line_of_sight(), for a line that open_part() gave. A look at the box about it settles most.
  bool clear(const Viewpoint& from, const LineSegment& line) const noexcept;
  /// Whether the closed box [low, high], voxel units, meets no occupied voxel, with the tolerance kTouch and more:
  /// nothing in it hides anything. Eight look-ups. Precondition: low ≤ high.
  bool empty(const Vec3& low, const Vec3& high) const noexcept;

 private:
  int empty_radius(const Index3& v) const noexcept {
    const auto x = static_cast<unsigned>(v.x()), y = static_cast<unsigned>(v.y()), z = static_cast<unsigned>(v.z());
    if (x >= nx_ || y >= ny_ || z >= nz_) return 1;
    return radius_[x + nx_ * (y + static_cast<std::size_t>(ny_) * z)];
  }

  void add_up();

  Vec3 origin_W_;
  double resolution_;
  unsigned nx_, ny_, nz_;
  std::vector<std::uint8_t> radius_;
  std::vector<std::uint32_t> sums_;  // (x, y, z), one more than voxels per axis: occupied voxels below x, y and z
};

}  // namespace backwash::field

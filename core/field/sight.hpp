// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/map/occupancy_grid.hpp"

namespace backwash::field {

/// Tolerance of "meets a closed box", voxel edges: a line through exactly an edge or a corner stays blocked under
/// rounding (the rounding of a coordinate 1 km from the origin is 1e-12 of an edge).
inline constexpr double kTouch = 1e-7;

/// Line segment in voxel units: voxel (i, j, k) is the box [i, i+1] × [j, j+1] × [k, k+1].
struct Segment {
  Vec3 from, delta;
};

/// Largest integer ≤ x, for |x| < 2³¹; std::floor is a library call without SSE 4.1.
inline int floor_to_int(double x) noexcept {
  const int i = static_cast<int>(x);
  return i - (x < i ? 1 : 0);
}

/// The segment from p to c without its last 2a (model.md section 1, "Visible"), in voxel units; nothing when |c − p| ≤
/// 2a.
std::optional<Segment> open_part(const Vec3& origin_W, double voxel_edge, const Vec3& p_W, const Vec3& c_W) noexcept;

/// Whether the segment meets the closed box of a voxel, with the tolerance kTouch: the slab test.
bool meets(const Segment& segment, const Index3& voxel) noexcept;

/// Whether a segment meets no occupied voxel. `empty_radius(v)`: 0 at an occupied voxel, else r ≥ 1 such that no voxel
/// nearer than r in the Chebyshev distance is occupied; r = 1 everywhere free is correct, a larger r is faster.
///
/// Marches along the dominant axis. From a point in a voxel of radius r, the next r − 1 are empty: jump. Near occupied
/// voxels (r ≤ 1) it goes slab by slab of unit thickness: the voxels that the piece in a slab can touch lie in its
/// bounding rectangle in the other two axes, one to four of them, and only an occupied one is tested exactly.
template <typename EmptyRadius>
bool clear(const Segment& segment, const EmptyRadius& empty_radius) noexcept {
  constexpr double kReach = 2 * kTouch;    // candidates reach further than meets() so that rounding loses none
  constexpr double kStep = 0.01 * kTouch;  // past a slab's end, so that the next floor() lands in the next slab
  int u = 0;
  const double length = segment.delta.cwiseAbs().maxCoeff(&u);
  const Vec3 slope = length > 0 ? Vec3(segment.delta / length) : Vec3::UnitX();  // a point: any direction will do
  const int v = (u + 1) % 3, w = (u + 2) % 3;
  const double end = length + kReach;
  for (double s = -kReach; s <= end;) {
    const Vec3 x = segment.from + s * slope;
    const Index3 cell(floor_to_int(x.x()), floor_to_int(x.y()), floor_to_int(x.z()));
    if (const int radius = empty_radius(cell); radius > 1) {
      s += radius - 1 - kReach;
      continue;
    }
    double piece = slope[u] > 0 ? cell[u] + 1 - x[u] : x[u] - cell[u];
    int last_u = cell[u];
    if (piece < kReach) {  // grazing the end of a slab: take it together with the next one
      piece += 1;
      last_u += slope[u] > 0 ? 1 : -1;
    }
    const auto [first_u, final_u] = std::minmax(cell[u], last_u);
    const double yv = x[v] + piece * slope[v], yw = x[w] + piece * slope[w];
    const int v0 = floor_to_int(std::min(x[v], yv) - kReach), v1 = floor_to_int(std::max(x[v], yv) + kReach);
    const int w0 = floor_to_int(std::min(x[w], yw) - kReach), w1 = floor_to_int(std::max(x[w], yw) + kReach);
    Index3 candidate;
    for (candidate[u] = first_u; candidate[u] <= final_u; ++candidate[u])
      for (candidate[v] = v0; candidate[v] <= v1; ++candidate[v])
        for (candidate[w] = w0; candidate[w] <= w1; ++candidate[w])
          if (empty_radius(candidate) == 0 && meets(segment, candidate)) return false;
    s += piece + kStep;
  }
  return true;
}

/// Whether the segment from p to c, its last 2a left out, meets no occupied voxel (model.md section 1, "Visible").
/// Voxels are closed boxes: a segment through exactly an edge or a corner is blocked if any voxel that touches that
/// point is occupied. Unknown voxels do not block. Does not test the normal. O(|c − p|/a).
bool line_of_sight(const map::OccupancyGrid& grid, const Vec3& p_W, const Vec3& c_W) noexcept;

/// A copy of a grid's occupied voxels made for fast lines of sight: the Chebyshev distance from each voxel to the
/// nearest occupied one, one byte each. Gives exactly the answers of line_of_sight().
class SightMap {
 public:
  /// O(cells).
  explicit SightMap(const map::OccupancyGrid& grid);
  /// As field::line_of_sight(grid, p, c). Thread-safe. About 5 jumps for a line across a room.
  bool line_of_sight(const Vec3& p_W, const Vec3& c_W) const noexcept;

 private:
  int empty_radius(const Index3& v) const noexcept {
    const auto x = static_cast<unsigned>(v.x()), y = static_cast<unsigned>(v.y()), z = static_cast<unsigned>(v.z());
    if (x >= nx_ || y >= ny_ || z >= nz_) return 1;
    return radius_[x + nx_ * (y + static_cast<std::size_t>(ny_) * z)];
  }

  Vec3 origin_W_;
  double resolution_;
  unsigned nx_, ny_, nz_;
  std::vector<std::uint8_t> radius_;
};

}  // namespace backwash::field

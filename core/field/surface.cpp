// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/surface.hpp"

#include <array>
#include <numeric>

namespace backwash::field {
namespace {

using map::Cell;
using map::OccupancyGrid;

/// Lateral faces of a voxel in the order that breaks ties (docs/model.md 1-6).
const std::array<Index3, 4> kFaces{Index3(1, 0, 0), Index3(-1, 0, 0), Index3(0, 1, 0), Index3(0, -1, 0)};
using Exposed = std::array<bool, 4>;

/// Top of the floor below the free voxel `v`, horizontally at c; none above unknown space or the end of the map.
std::optional<Vec3> corner_below(const OccupancyGrid& grid, Index3 v, const Vec3& c_W) {
  while (grid.free(v)) --v.z();
  if (!grid.occupied(v)) return std::nullopt;
  return Vec3(c_W.x(), c_W.y(), grid.origin().z() + grid.resolution() * (v.z() + 1));
}

/// g = −Σ (d_i, d_j)·[voxel (i+d_i, j+d_j, k+d_k) is not free] over |d_i|, |d_j| ≤ 2, |d_k| ≤ 1.
Eigen::Vector2i outward(const OccupancyGrid& grid, const Index3& v) {
  Eigen::Vector2i g(0, 0);
  for (int dk = -1; dk <= 1; ++dk)
    for (int dj = -2; dj <= 2; ++dj)
      for (int di = -2; di <= 2; ++di)
        if (!grid.free(v + Index3(di, dj, dk))) g -= Eigen::Vector2i(di, dj);
  return g;
}

Element lateral_element(const OccupancyGrid& grid, const Index3& v, const Vec3& m, const Index3& face) {
  const double a = grid.resolution();
  const Vec3 c = grid.center(v) + 0.5 * a * m;
  const double area = a * a / m.cwiseAbs().maxCoeff();
  return {Element::Kind::lateral, c, m, area, corner_below(grid, v + face, c)};
}

void add_lateral_elements(const OccupancyGrid& grid, const Index3& v, std::vector<Element>& elements) {
  Exposed exposed;
  for (std::size_t f = 0; f < 4; ++f) exposed[f] = grid.free(v + kFaces[f]);
  if (exposed == Exposed{}) return;

  const bool one_voxel_wall = (exposed[0] && exposed[1]) || (exposed[2] && exposed[3]);
  const Eigen::Vector2i g = outward(grid, v);
  int best = 0;  // g is a vector of integers: its products with the faces are exact, and so are ties
  std::size_t best_face = 0;
  for (std::size_t f = 0; f < 4; ++f)
    if (const int along = g.dot(kFaces[f].head<2>()); exposed[f] && along > best) {
      best = along;
      best_face = f;
    }

  if (!one_voxel_wall && best > 0) {
    // Without the common divisor, so that normals of one direction are equal in every bit.
    const Eigen::Vector2i shortest = g / std::gcd(g.x(), g.y());
    const Eigen::Vector2d m = shortest.cast<double>().normalized();
    elements.push_back(lateral_element(grid, v, Vec3(m.x(), m.y(), 0), kFaces[best_face]));
    return;
  }
  for (std::size_t f = 0; f < 4; ++f)
    if (exposed[f]) elements.push_back(lateral_element(grid, v, kFaces[f].cast<double>(), kFaces[f]));
}

}  // namespace

std::vector<Element> surface_elements(const OccupancyGrid& grid, bool unknown_floor) {
  std::vector<Element> elements;
  const double a = grid.resolution();
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const bool occupied = grid.at(n) == Cell::occupied;
    if (!occupied && !(unknown_floor && grid.at(n) == Cell::unknown)) continue;
    const Index3 v = grid.voxel(n);
    if (grid.free(v + Index3(0, 0, 1)))
      elements.push_back({Element::Kind::up, grid.center(v) + Vec3(0, 0, 0.5 * a), Vec3::UnitZ(), a * a, std::nullopt});
    if (occupied) add_lateral_elements(grid, v, elements);
  }
  return elements;
}

}  // namespace backwash::field

// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/scan/regrid.hpp"

#include <cmath>

#include "core/map/lattice_box.hpp"

namespace backwash::map {
namespace {

/// What a box of voxels holds: occupied before unknown before free. Outside the grid is unknown.
Cell worst_of(const OccupancyGrid& grid, const Index3& first, const Index3& last) noexcept {
  Cell worst = Cell::free;
  for (int k = first.z(); k <= last.z(); ++k) {
    for (int j = first.y(); j <= last.y(); ++j) {
      for (int i = first.x(); i <= last.x(); ++i) {
        const Cell cell = grid.at({i, j, k});
        if (cell == Cell::occupied) return cell;
        if (cell == Cell::unknown) worst = cell;
      }
    }
  }
  return worst;
}

}  // namespace

std::pair<Vec3, Vec3> placed_box(const Placement& place, const Vec3& low, const Vec3& high) noexcept {
  const Vec3 middle = place(0.5 * (low + high)), half = place.R_W.cwiseAbs() * (0.5 * place.scale * (high - low));
  return {middle - half, middle + half};
}

void regrid(const OccupancyGrid& source, const Placement& place, OccupancyGrid& target) {
  // Half the box around a target's voxel, in the source's voxels, without the share of it that only touches.
  const double ratio = target.resolution() / (place.scale * source.resolution());
  const Vec3 half = (place.R_W.transpose().cwiseAbs() * Vec3::Constant(0.5 * ratio)).array() - kOnFace;
  const Vec3 most = source.size().cast<double>();
  for (std::size_t n = 0; n < target.cell_count(); ++n) {
    const Index3 v = target.voxel(n);
    const Vec3 middle = (place.back(target.center(v)) - source.origin()) / source.resolution();
    // Beyond one voxel outside all is unknown: what is farther need not be a number of voxels that int can hold.
    const Vec3 low = (middle - half.cwiseMax(0)).cwiseMax(-1).cwiseMin(most);
    const Vec3 high = (middle + half.cwiseMax(0)).cwiseMax(-1).cwiseMin(most);
    target.set(v, worst_of(source, low.array().floor().cast<int>(), high.array().floor().cast<int>()));
  }
}

}  // namespace backwash::map

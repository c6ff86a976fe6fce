// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/occupancy_sums.hpp"

#include <algorithm>
#include <memory>

namespace backwash::map {

OccupancySums::OccupancySums(const OccupancyGrid& grid)
    : origin_W_(grid.origin()), per_voxel_(1 / grid.resolution()), cubes_(grid.size(), nullptr) {
  update(grid, Index3::Zero(), grid.size() - Index3::Ones());
}

void OccupancySums::update(const OccupancyGrid& grid, const Index3& low, const Index3& high) {
  for (const std::size_t n : cubes_.meeting({low, high}))
    cubes_.replace(n, std::make_shared<const Cube>(cube_of(grid, cubes_.voxels(n))));
}

// Layer by layer: the sum over the layer's rows so far, on top of what the layer below holds.
OccupancySums::Cube OccupancySums::cube_of(const OccupancyGrid& grid, const VoxelBox& voxels) {
  const Index3 extent = voxels.high - voxels.low + Index3::Ones();
  const auto width = static_cast<std::size_t>(extent.x());
  Cube cube{width + 1, (width + 1) * (static_cast<std::size_t>(extent.y()) + 1), {}};
  cube.sums.assign(cube.stride_z * (static_cast<std::size_t>(extent.z()) + 1), 0);
  std::vector<Sum> rows(width + 1);  // of this layer, over the rows so far
  for (int k = 0; k < extent.z(); ++k) {
    const Sum* below = cube.sums.data() + static_cast<std::size_t>(k) * cube.stride_z;
    Sum* sums = cube.sums.data() + static_cast<std::size_t>(k + 1) * cube.stride_z;
    std::ranges::fill(rows, Sum{0});
    for (int j = 0; j < extent.y(); ++j) {
      const Cell* const cells = grid.cells().data() + grid.linear(voxels.low + Index3(0, j, k));
      below += cube.stride_y;
      sums += cube.stride_y;
      Sum row = 0;
      for (std::size_t i = 0; i < width; ++i) {
        row = static_cast<Sum>(row + (cells[i] != Cell::free));
        rows[i + 1] = static_cast<Sum>(rows[i + 1] + row);
        sums[i + 1] = static_cast<Sum>(below[i + 1] + rows[i + 1]);
      }
    }
  }
  return cube;
}

bool OccupancySums::voxels_free(const Index3& low, const Index3& high) const noexcept {
  if ((low.array() > high.array()).any()) return true;
  return (low.array() >= 0).all() && (high.array() < cubes_.size().array()).all() && all_free(low, high);
}

bool OccupancySums::all_free(const Index3& low, const Index3& high) const noexcept {
  constexpr int kEdge = Cubes::kEdge, kInside = kEdge - 1;
  const auto own = [](const Index3& v) { return Index3(v.x() & kInside, v.y() & kInside, v.z() & kInside); };
  const int apart = (low.x() ^ high.x()) | (low.y() ^ high.y()) | (low.z() ^ high.z());
  if (apart < kEdge) [[likely]]
    return free_in(cubes_.of(low), own(low), own(high));
  return cubes_free(low, high);
}

bool OccupancySums::cubes_free(const Index3& low, const Index3& high) const noexcept {
  constexpr int kEdge = Cubes::kEdge, kInside = kEdge - 1;
  const Index3 first(low.x() & ~kInside, low.y() & ~kInside, low.z() & ~kInside);  // of the lowest cube
  for (int z = first.z(); z <= high.z(); z += kEdge)
    for (int y = first.y(); y <= high.y(); y += kEdge)
      for (int x = first.x(); x <= high.x(); x += kEdge) {
        const Index3 cube(x, y, z);
        if (!free_in(cubes_.of(cube), (low - cube).cwiseMax(0), (high - cube).cwiseMin(kInside))) return false;
      }
  return true;
}

bool OccupancySums::free_in(const Cube& cube, const Index3& low, const Index3& high) noexcept {
  const auto left = static_cast<std::size_t>(low.x()), right = static_cast<std::size_t>(high.x()) + 1;
  const auto front = static_cast<std::size_t>(low.y()), back = static_cast<std::size_t>(high.y()) + 1;
  const auto under = static_cast<std::size_t>(low.z()), over = static_cast<std::size_t>(high.z()) + 1;
  if ((right - left) * (back - front) * (over - under) > UINT16_MAX) return halves_free_in(cube, low, high);
  const Sum* const sums = cube.sums.data();
  const std::size_t y = cube.stride_y, z = cube.stride_z;
  const auto layer = [=](const Sum* at) {
    return at[back * y + right] - at[back * y + left] - at[front * y + right] + at[front * y + left];
  };
  return static_cast<Sum>(layer(sums + over * z) - layer(sums + under * z)) == 0;
}

bool OccupancySums::halves_free_in(const Cube& cube, const Index3& low, const Index3& high) noexcept {
  Index3 middle = high, after = low;
  int axis = 0;
  (high - low).maxCoeff(&axis);
  middle[axis] = low[axis] + (high[axis] - low[axis]) / 2;
  after[axis] = middle[axis] + 1;
  return free_in(cube, low, middle) && free_in(cube, after, high);
}

bool OccupancySums::box_free(const Vec3& low_W, const Vec3& high_W) const noexcept {
  Index3 low, high;
  bool inside = true;  // one branch for all axes
  for (int axis = 0; axis < 3; ++axis) {
    const double from = (low_W[axis] - origin_W_[axis]) * per_voxel_;
    const double to = (high_W[axis] - origin_W_[axis]) * per_voxel_;
    const bool within = (from > 0) & (from <= to) & (to < cubes_.size()[axis]);  // before the casts; false for NaN
    inside &= within;
    low[axis] = within ? static_cast<int>(from) : 0;
    low[axis] -= low[axis] == from;  // a face belongs to both of its voxels
    high[axis] = within ? static_cast<int>(to) : 0;
  }
  return inside && all_free(low, high);
}

}  // namespace backwash::map

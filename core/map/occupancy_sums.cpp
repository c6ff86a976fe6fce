// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/occupancy_sums.hpp"

#include <algorithm>
#include <stdexcept>

namespace backwash::map {

OccupancySums::OccupancySums(const OccupancyGrid& grid)
    : origin_W_(grid.origin()),
      per_voxel_(1 / grid.resolution()),
      size_(grid.size()),
      stride_y_(static_cast<std::size_t>(size_.x()) + 1),
      stride_z_(stride_y_ * (static_cast<std::size_t>(size_.y()) + 1)) {
  if (grid.cell_count() >= std::size_t{1} << 31) throw std::length_error("the grid is too large for its sums");
  sums_.assign(stride_z_ * (static_cast<std::size_t>(size_.z()) + 1), 0);
  add_up(grid, Index3::Zero());
}

void OccupancySums::update(const OccupancyGrid& grid, const Index3& low, const Index3& high) {
  const Index3 from = low.cwiseMax(0);
  if ((from.array() > high.array().min(size_.array() - 1)).any()) return;
  add_up(grid, from);
}

// Row by row: the sum of the row so far, on top of what the layers below and before hold.
void OccupancySums::add_up(const OccupancyGrid& grid, const Index3& from) noexcept {
  const auto width = static_cast<std::size_t>(size_.x());
  for (int k = from.z(); k < size_.z(); ++k) {
    for (int j = from.y(); j < size_.y(); ++j) {
      const Cell* const cells = grid.cells().data() + grid.linear(Index3(0, j, k));
      std::uint32_t* const sums = sums_.data() + linear(1, j + 1, k + 1);
      const auto first = static_cast<std::size_t>(from.x());
      const auto rest = [&](std::size_t i) {  // all but this row, with unsigned wrap-around
        return sums[i - stride_y_] + sums[i - stride_z_] - sums[i - stride_y_ - stride_z_];
      };
      std::uint32_t row = first == 0 ? 0 : sums[first - 1] - rest(first - 1);
      for (std::size_t i = first; i < width; ++i) {
        row += cells[i] != Cell::free;
        sums[i] = row + rest(i);
      }
    }
  }
}

bool OccupancySums::voxels_free(const Index3& low, const Index3& high) const noexcept {
  if ((low.array() > high.array()).any()) return true;
  return (low.array() >= 0).all() && (high.array() < size_.array()).all() && all_free(low, high);
}

bool OccupancySums::all_free(const Index3& low, const Index3& high) const noexcept {
  const std::uint32_t* const below = sums_.data() + static_cast<std::size_t>(low.z()) * stride_z_;
  const std::uint32_t* const above = sums_.data() + static_cast<std::size_t>(high.z() + 1) * stride_z_;
  const std::size_t front = static_cast<std::size_t>(low.y()) * stride_y_;
  const std::size_t back = static_cast<std::size_t>(high.y() + 1) * stride_y_;
  const auto left = static_cast<std::size_t>(low.x()), right = static_cast<std::size_t>(high.x()) + 1;
  const auto layer = [&](const std::uint32_t* sums) {
    return sums[back + right] - sums[back + left] - sums[front + right] + sums[front + left];
  };
  return layer(above) == layer(below);
}

bool OccupancySums::box_free(const Vec3& low_W, const Vec3& high_W) const noexcept {
  Index3 low, high;
  bool inside = true;  // one branch for all axes
  for (int axis = 0; axis < 3; ++axis) {
    const double from = (low_W[axis] - origin_W_[axis]) * per_voxel_;
    const double to = (high_W[axis] - origin_W_[axis]) * per_voxel_;
    const bool within = (from > 0) & (from <= to) & (to < size_[axis]);  // before the casts; false for NaN
    inside &= within;
    low[axis] = within ? static_cast<int>(from) : 0;
    low[axis] -= low[axis] == from;  // a face belongs to both of its voxels
    high[axis] = within ? static_cast<int>(to) : 0;
  }
  return inside && all_free(low, high);
}

}  // namespace backwash::map

// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/occupancy_sums.hpp"

#include <algorithm>

namespace backwash::map {

OccupancySums::OccupancySums(const OccupancyGrid& grid)
    : origin_W_(grid.origin()),
      per_voxel_(1 / grid.resolution()),
      size_(grid.size()),
      stride_y_(static_cast<std::size_t>(size_.x()) + 1),
      stride_z_(stride_y_ * (static_cast<std::size_t>(size_.y()) + 1)) {
  sums_.assign(stride_z_ * (static_cast<std::size_t>(size_.z()) + 1), 0);
  add_up(grid, Index3::Zero());
}

void OccupancySums::update(const OccupancyGrid& grid, const Index3& low, const Index3& high) {
  const Index3 from = low.cwiseMax(0);
  if ((from.array() > high.array().min(size_.array() - 1)).any()) return;
  add_up(grid, from);
}

// Layer by layer: the sum over the layer's rows so far, on top of what the layer below holds.
void OccupancySums::add_up(const OccupancyGrid& grid, const Index3& from) {
  const auto first = static_cast<std::size_t>(from.x()), width = static_cast<std::size_t>(size_.x());
  std::vector<Sum> rows(width + 1);  // of this layer, over the rows so far
  for (int k = from.z(); k < size_.z(); ++k) {
    const Sum* below = sums_.data() + linear(0, from.y(), k);
    Sum* sums = sums_.data() + linear(0, from.y(), k + 1);
    for (std::size_t i = first; i <= width; ++i) rows[i] = static_cast<Sum>(sums[i] - below[i]);
    for (int j = from.y(); j < size_.y(); ++j) {
      const Cell* const cells = grid.cells().data() + grid.linear(Index3(0, j, k));
      below += stride_y_, sums += stride_y_;
      auto row = static_cast<Sum>(sums[first] - below[first] - rows[first]);  // before `first`: as it was
      rows[first] = static_cast<Sum>(rows[first] + row);
      for (std::size_t i = first; i < width; ++i) {
        row = static_cast<Sum>(row + (cells[i] != Cell::free));
        rows[i + 1] = static_cast<Sum>(rows[i + 1] + row);
        sums[i + 1] = static_cast<Sum>(below[i + 1] + rows[i + 1]);
      }
    }
  }
}

bool OccupancySums::voxels_free(const Index3& low, const Index3& high) const noexcept {
  if ((low.array() > high.array()).any()) return true;
  return (low.array() >= 0).all() && (high.array() < size_.array()).all() && all_free(low, high);
}

bool OccupancySums::halves_free(const Index3& low, const Index3& high) const noexcept {
  int axis = 0;
  (high - low).maxCoeff(&axis);
  Index3 middle = high;
  middle[axis] = low[axis] + (high[axis] - low[axis]) / 2;
  Index3 after = low;
  after[axis] = middle[axis] + 1;
  return all_free(low, middle) && all_free(after, high);
}

bool OccupancySums::all_free(const Index3& low, const Index3& high) const noexcept {
  const auto edge = [&](int axis) { return static_cast<std::uint64_t>(high[axis] - low[axis] + 1); };
  if (edge(0) * edge(1) * edge(2) > UINT16_MAX) return halves_free(low, high);
  const Sum* const below = sums_.data() + static_cast<std::size_t>(low.z()) * stride_z_;
  const Sum* const above = sums_.data() + static_cast<std::size_t>(high.z() + 1) * stride_z_;
  const std::size_t front = static_cast<std::size_t>(low.y()) * stride_y_;
  const std::size_t back = static_cast<std::size_t>(high.y() + 1) * stride_y_;
  const auto left = static_cast<std::size_t>(low.x()), right = static_cast<std::size_t>(high.x()) + 1;
  const auto layer = [&](const Sum* sums) {
    return sums[back + right] - sums[back + left] - sums[front + right] + sums[front + left];
  };
  return static_cast<Sum>(layer(above) - layer(below)) == 0;
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

// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/bound_field.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::reach {
namespace {

template <std::size_t N>
void raise(std::array<float, N>& maximum, const std::array<float, N>& other) noexcept {
  for (std::size_t d = 0; d < N; ++d) maximum[d] = std::max(maximum[d], other[d]);
}

template <class Visit>
void for_each_voxel(const Index3& size, const Visit& visit) {
  for (int k = 0; k < size.z(); ++k) {
    for (int j = 0; j < size.y(); ++j) {
      for (int i = 0; i < size.x(); ++i) visit(Index3(i, j, k));
    }
  }
}

}  // namespace

BoundField::BoundField(const map::OccupancyGrid& grid, const field::DisturbanceField& field, const BoundModel& model)
    : origin_W_(grid.origin()), resolution_(grid.resolution()), size_(grid.size()) {
  std::vector<std::uint8_t> stored(grid.cell_count(), 0);
  for_each_voxel(size_, [&](const Index3& v) { stored[grid.linear(v)] = field.has(v); });
  number_entries(stored);
  for_each_voxel(size_, [&](const Index3& v) {
    if (!stored[grid.linear(v)]) return;
    const DisturbanceBound w = bound(field.at(v), model);
    std::copy(w.w.begin(), w.w.end(), entries_[entry_of_[grid.linear(v)]].level[0].begin());
  });
  for (int level = 1; level < kLevels; ++level) pool(level);
}

// An entry for each voxel whose largest cube holds a stored voxel: dilation by the cube, axis by axis. Running over the
// end of a row only adds entries that nobody needs.
void BoundField::number_entries(std::vector<std::uint8_t> stored) {
  const auto sx = static_cast<std::size_t>(size_.x()), sy = static_cast<std::size_t>(size_.y());
  for (const std::size_t stride : {std::size_t{1}, sx, sx * sy}) {
    for (std::size_t n = 0; n < stored.size(); ++n) {
      for (std::size_t step = 1; step < (1u << (kLevels - 1)) && n + step * stride < stored.size(); ++step) {
        stored[n] |= stored[n + step * stride];
      }
    }
  }
  entry_of_.assign(stored.size(), 0);
  std::uint32_t count = 1;
  for (std::size_t n = 0; n < stored.size(); ++n) {
    if (stored[n]) entry_of_[n] = count++;
  }
  entries_.resize(count);
}

// The cube of level L is the union of the eight cubes of level L − 1 at its octants.
void BoundField::pool(int level) noexcept {
  const int half = 1 << (level - 1);
  const auto sx = static_cast<std::size_t>(size_.x()), sy = static_cast<std::size_t>(size_.y());
  std::array<std::size_t, 8> ahead;  // of an octant, in cells
  for (std::size_t octant = 0; octant < 8; ++octant)
    ahead[octant] = static_cast<std::size_t>(half) * ((octant & 1) + sx * ((octant >> 1 & 1) + sy * (octant >> 2)));
  std::size_t n = 0;
  for_each_voxel(size_, [&](const Index3& v) {
    const std::size_t here = n++;
    const std::uint32_t e = entry_of_[here];
    if (e == 0) return;
    const std::size_t beyond = (v.x() + half < size_.x() ? 0u : 1u) | (v.y() + half < size_.y() ? 0u : 2u) |
                               (v.z() + half < size_.z() ? 0u : 4u);  // axes along which the octant is outside
    Maximum maximum{};
    for (std::size_t octant = 0; octant < 8; ++octant)
      if (!(octant & beyond)) raise(maximum, entries_[entry_of_[here + ahead[octant]]].level[level - 1]);
    entries_[e].level[level] = maximum;
  });
}

bool BoundField::inside(const Index3& v) const noexcept {
  return (v.array() >= 0).all() && (v.array() < size_.array()).all();
}

const BoundField::Entry& BoundField::entry(const Index3& v) const noexcept {
  const auto row =
      static_cast<std::size_t>(v.y()) + static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(v.z());
  return entries_[entry_of_[static_cast<std::size_t>(v.x()) + static_cast<std::size_t>(size_.x()) * row]];
}

DisturbanceBound BoundField::max_over(const Vec3& low_W, const Vec3& high_W) const noexcept {
  // Closed voxels: one that only touches the box counts. Compared before the casts, so that any box is in range.
  Index3 low, high;
  for (int axis = 0; axis < 3; ++axis) {
    const double from = (low_W[axis] - origin_W_[axis]) / resolution_;
    const double to = (high_W[axis] - origin_W_[axis]) / resolution_;
    if (!(from <= size_[axis]) || !(to >= 0)) return {};
    low[axis] = from > 0 ? static_cast<int>(from) : 0;
    low[axis] -= from > 0 && low[axis] == from;
    high[axis] = to < size_[axis] ? static_cast<int>(to) : size_[axis] - 1;
  }
  return max_over_voxels(low, high);
}

DisturbanceBound BoundField::max_over_voxels(Index3 low, Index3 high) const noexcept {
  DisturbanceBound result;
  low = low.cwiseMax(0);
  high = high.cwiseMin(size_ - Index3::Ones());
  if ((low.array() > high.array()).any()) return result;
  const int narrowest = (high - low).minCoeff() + 1;
  int level = 0;
  while (level + 1 < kLevels && narrowest >= 2 << level) ++level;
  const int edge = 1 << level;
  // Cubes side by side; the last one of each row is moved back to end with the box.
  const Index3 end = high - Index3::Constant(edge - 1);
  const auto sx = static_cast<std::size_t>(size_.x()), sy = static_cast<std::size_t>(size_.y());
  const auto at_level = static_cast<std::size_t>(level);
  Maximum maximum{};
  for (int k = low.z(); k <= high.z(); k += edge) {
    for (int j = low.y(); j <= high.y(); j += edge) {
      const std::uint32_t* const row = entry_of_.data() + sx * (static_cast<std::size_t>(std::min(j, end.y())) +
                                                                sy * static_cast<std::size_t>(std::min(k, end.z())));
      for (int i = low.x(); i <= high.x(); i += edge)
        raise(maximum, entries_[row[std::min(i, end.x())]].level[at_level]);
    }
  }
  std::copy(maximum.begin(), maximum.end(), result.w.begin());
  return result;
}

DisturbanceBound BoundField::at(const Index3& v) const noexcept {
  DisturbanceBound result;
  if (!inside(v)) return result;
  const Maximum& w = entry(v).level[0];
  std::copy(w.begin(), w.end(), result.w.begin());
  return result;
}

}  // namespace backwash::reach

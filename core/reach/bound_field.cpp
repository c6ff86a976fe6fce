// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/bound_field.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/map/lattice.hpp"

namespace backwash::reach {
namespace {

template <std::size_t N>
void raise(std::array<BoundCode, N>& maximum, const std::array<BoundCode, N>& other) noexcept {
  for (std::size_t d = 0; d < N; ++d) maximum[d] = std::max(maximum[d], other[d]);
}

template <class Visit>
void for_each_voxel(const map::VoxelBox& box, const Visit& visit) {
  for (int k = box.low.z(); k <= box.high.z(); ++k) {
    for (int j = box.low.y(); j <= box.high.y(); ++j) {
      for (int i = box.low.x(); i <= box.high.x(); ++i) visit(Index3(i, j, k));
    }
  }
}

/// All voxels of a grid of that size.
map::VoxelBox all_of(const Index3& size) { return {Index3::Zero(), size - Index3::Ones()}; }

/// Of each voxel whether a cube of `edge` voxels on from it holds a stored one: dilation, axis by axis. Running over
/// the end of a row only marks voxels that nobody needs.
void dilate(std::vector<std::uint8_t>& stored, const Index3& size, std::size_t edge) {
  const auto sx = static_cast<std::size_t>(size.x()), sy = static_cast<std::size_t>(size.y());
  for (const std::size_t stride : {std::size_t{1}, sx, sx * sy})
    for (std::size_t n = 0; n < stored.size(); ++n)
      for (std::size_t step = 1; step < edge && n + step * stride < stored.size(); ++step)
        stored[n] |= stored[n + step * stride];
}

}  // namespace

BoundField::BoundField(const map::OccupancyGrid& grid, const field::DisturbanceField& field, const BoundModel& model,
                       field::Extension extension)
    : origin_W_(grid.origin()),
      resolution_(grid.resolution()),
      size_(grid.size()),
      extension_(std::move(extension)),
      model_(model) {
  std::vector<std::uint8_t> stored(grid.cell_count(), 0);
  for_each_voxel(all_of(size_), [&](const Index3& v) { stored[grid.linear(v)] = field.has(v); });
  dilate(stored, size_, kLargest);
  number_entries(stored);
  for_each_voxel(all_of(size_), [&](const Index3& v) {
    if (!field.has(v)) return;
    DisturbanceBound w = bound(field.at(v), model);
    if (extension_.by_place()) {
      const Air air = extension_.at(v);
      for (std::size_t d = 0; d < kDirections; ++d) w.w[d] += d == kZ ? air.vertical : air.level;
      least_push_ = least_push_.cwiseMin(air.push_W);
      largest_push_ = largest_push_.cwiseMax(air.push_W);
    }
    std::ranges::transform(w.w, entries_[entry_of(grid.linear(v))].level[0].begin(), code_of);
  });
  for (int level = 1; level < kLevels; ++level) pool(level, all_of(size_));
}

BoundField::BoundField(const BoundField& old, const field::DisturbanceField& field, const map::VoxelBox& changed)
    : origin_W_(old.origin_W_),
      resolution_(old.resolution_),
      size_(old.size_),
      extension_(old.extension_),
      model_(old.model_),
      least_push_(old.least_push_),
      largest_push_(old.largest_push_) {
  constexpr int kAhead = static_cast<int>(kLargest) - 1;  // of a cube's lowest voxel
  const map::VoxelBox anew{(changed.low - Index3::Constant(kAhead)).cwiseMax(0), changed.high};
  const map::VoxelBox read{anew.low, anew.high + Index3::Constant(kAhead)};
  std::vector<std::uint8_t> stored, entered(old.rank_.size());
  for_each_voxel(read, [&](const Index3& v) { stored.push_back(field.has(v)); });
  const Index3 extent = read.high - read.low + Index3::Ones();
  dilate(stored, extent, kLargest);
  std::ranges::transform(old.rank_, entered.begin(), [](std::uint8_t rank) { return rank != 0; });
  for_each_voxel(anew,
                 [&](const Index3& v) { entered[map::linear(size_, v)] = stored[map::linear(extent, v - read.low)]; });
  number_entries(entered);
  copy_entries(old);
  for_each_voxel(anew, [&](const Index3& v) {
    const std::size_t e = entry_of(map::linear(size_, v));
    if (e == 0) return;
    entries_[e] = {};
    if (field.has(v)) std::ranges::transform(bound(field.at(v), model_).w, entries_[e].level[0].begin(), code_of);
  });
  for (int level = 1; level < kLevels; ++level) pool(level, anew);
}

// Of the voxels that have one in both.
void BoundField::copy_entries(const BoundField& old) noexcept {
  std::size_t from = 0, to = 0;
  for (std::size_t n = 0; n < rank_.size(); ++n) {
    const bool was = old.rank_[n] != 0, is = rank_[n] != 0;
    from += was, to += is;
    if (was && is) entries_[to] = old.entries_[from];
  }
}

void BoundField::number_entries(const std::vector<std::uint8_t>& entered) {
  rank_.assign(entered.size(), 0);
  before_.reserve((entered.size() + kRun - 1) / kRun);
  std::uint32_t count = 0;
  for (std::size_t n = 0; n < entered.size(); ++n) {
    if (n % kRun == 0) before_.push_back(count);
    if (entered[n]) rank_[n] = static_cast<std::uint8_t>(++count - before_.back());
  }
  entries_.resize(count + std::size_t{1});
}

std::size_t BoundField::entry_of(std::size_t n) const noexcept {
  const std::uint32_t rank = rank_[n], some = 0u - std::uint32_t{rank != 0};  // all bits or none
  return (before_[n / kRun] + rank) & some;
}

DisturbanceBound BoundField::decoded(const Maximum& codes) noexcept {
  DisturbanceBound result;
  for (std::size_t d = 0; d < kDirections; ++d) result.w[d] = bound_of(codes[d]);
  return result;
}

// The cube of level L is the union of the eight cubes of level L − 1 at its octants.
void BoundField::pool(int level, const map::VoxelBox& box) noexcept {
  const int half = 1 << (level - 1);
  const auto sx = static_cast<std::size_t>(size_.x()), sy = static_cast<std::size_t>(size_.y());
  std::array<std::size_t, 8> ahead;  // of an octant, in cells
  for (std::size_t octant = 0; octant < 8; ++octant)
    ahead[octant] = static_cast<std::size_t>(half) * ((octant & 1) + sx * ((octant >> 1 & 1) + sy * (octant >> 2)));
  for_each_voxel(box, [&](const Index3& v) {
    const std::size_t here = map::linear(size_, v), e = entry_of(here);
    if (e == 0) return;
    const std::size_t beyond = (v.x() + half < size_.x() ? 0u : 1u) | (v.y() + half < size_.y() ? 0u : 2u) |
                               (v.z() + half < size_.z() ? 0u : 4u);  // axes along which the octant is outside
    Maximum maximum{};
    for (std::size_t octant = 0; octant < 8; ++octant)
      if (!(octant & beyond)) raise(maximum, entries_[entry_of(here + ahead[octant])].level[level - 1]);
    entries_[e].level[level] = maximum;
  });
}

bool BoundField::inside(const Index3& v) const noexcept { return map::inside(size_, v); }

// Closed voxels: one that only touches the box counts. Compared before the casts, so that any box is in range.
map::VoxelBox BoundField::meeting(const Vec3& low_W, const Vec3& high_W) const noexcept {
  map::VoxelBox box;
  Index3 &low = box.low, &high = box.high;
  for (int axis = 0; axis < 3; ++axis) {
    const double from = (low_W[axis] - origin_W_[axis]) / resolution_;
    const double to = (high_W[axis] - origin_W_[axis]) / resolution_;
    if (!(from <= size_[axis]) || !(to >= 0)) return {Index3::Ones(), Index3::Zero()};
    low[axis] = from > 0 ? static_cast<int>(from) : 0;
    low[axis] -= from > 0 && low[axis] == from;
    high[axis] = to < size_[axis] ? static_cast<int>(to) : size_[axis] - 1;
  }
  return box;
}

DisturbanceBound BoundField::max_over(const Vec3& low_W, const Vec3& high_W) const noexcept {
  const map::VoxelBox box = meeting(low_W, high_W);
  return max_over_voxels(box.low, box.high);
}

DisturbanceBound BoundField::max_about(const Vec3& push_W, const Vec3& v_W, const Vec3& low_W,
                                       const Vec3& high_W) const noexcept {
  const map::VoxelBox box = meeting(low_W, high_W);
  return max_about_voxels(push_W, v_W, box.low, box.high);
}

DisturbanceBound BoundField::max_about_voxels(const Vec3& push_W, const Vec3& v_W, const Index3& low,
                                              const Index3& high) const noexcept {
  if (extension_.none()) return max_over_voxels(low, high);
  if (!extension_.by_place()) return moving(max_over_voxels(low, high), v_W);
  const Vec3 here = push_W - extension_.moving(v_W).push_W;  // of the place alone
  const auto deviation = [](const Vec3& n, const Vec3& of) { return std::abs(n.dot(of)); };
  DisturbanceBound result;
  const map::VoxelBox box{low.cwiseMax(0), high.cwiseMin(size_ - Index3::Ones())};
  if (box.empty()) return result;
  if ((box.high - box.low + Index3::Ones()).prod() > kFew) {
    result = moving(max_over_voxels(low, high), v_W);
    const Vec3 most = (here - least_push_).cwiseAbs().cwiseMax((largest_push_ - here).cwiseAbs());
    for (std::size_t d = 0; d < kDirections; ++d) result.w[d] += unit(static_cast<Direction>(d)).cwiseAbs().dot(most);
    return result;
  }
  for (int k = box.low.z(); k <= box.high.z(); ++k)
    for (int j = box.low.y(); j <= box.high.y(); ++j)
      for (int i = box.low.x(); i <= box.high.x(); ++i) {
        const DisturbanceBound found = at({i, j, k});
        if (!(found.w[kZ] > 0)) continue;  // not stored
        const DisturbanceBound w = moving(found, v_W);
        const Vec3 off = extension_.at({i, j, k}).push_W - here;
        for (std::size_t d = 0; d < kDirections; ++d)
          result.w[d] = std::max(result.w[d], w.w[d] + deviation(unit(static_cast<Direction>(d)), off));
      }
  return result;
}

PerDirection BoundField::push_spread(const Vec3& push_W, const Vec3& v_W, const Vec3& low_W,
                                     const Vec3& high_W) const noexcept {
  PerDirection spread{};
  const Air moving = extension_.moving(v_W);
  const map::VoxelBox box = meeting(low_W, high_W);
  for (int k = std::max(box.low.z(), 0); extension_.by_place() && k <= std::min(box.high.z(), size_.z() - 1); ++k)
    for (int j = std::max(box.low.y(), 0); j <= std::min(box.high.y(), size_.y() - 1); ++j)
      for (int i = std::max(box.low.x(), 0); i <= std::min(box.high.x(), size_.x() - 1); ++i) {
        if (!(at({i, j, k}).w[kZ] > 0)) continue;  // not stored
        const Vec3 off = extension_.at({i, j, k}).push_W + moving.push_W - push_W;
        for (std::size_t d = 0; d < kDirections; ++d)
          spread[d] = std::max(spread[d], std::abs(unit(static_cast<Direction>(d)).dot(off)));
      }
  for (std::size_t d = 0; d < kDirections; ++d) spread[d] += d == kZ ? moving.vertical : moving.level;
  return spread;
}

// Σ's factor by speed, and what is not known of the pushes by velocity.
DisturbanceBound BoundField::moving(DisturbanceBound w, const Vec3& v_W) const noexcept {
  const Air air = extension_.moving(v_W);
  const double factor = std::exp(air.ln_variance / 2);
  for (std::size_t d = 0; d < kDirections; ++d) {
    const double mean = d == kZ ? model_.mean_vertical : model_.mean_horizontal;
    w.w[d] = mean + factor * (w.w[d] - mean) + (d == kZ ? air.vertical : air.level);
  }
  return w;
}

DisturbanceBound BoundField::max_over_voxels(Index3 low, Index3 high) const noexcept {
  low = low.cwiseMax(0);
  high = high.cwiseMin(size_ - Index3::Ones());
  if ((low.array() > high.array()).any()) return {};
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
      const std::size_t row =
          sx * (static_cast<std::size_t>(std::min(j, end.y())) + sy * static_cast<std::size_t>(std::min(k, end.z())));
      for (int i = low.x(); i <= high.x(); i += edge)
        raise(maximum, entries_[entry_of(row + static_cast<std::size_t>(std::min(i, end.x())))].level[at_level]);
    }
  }
  return decoded(maximum);
}

DisturbanceBound BoundField::at(const Index3& v) const noexcept {
  if (!inside(v)) return {};
  return decoded(entries_[entry_of(map::linear(size_, v))].level[0]);
}

}  // namespace backwash::reach

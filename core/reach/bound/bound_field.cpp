// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/bound/bound_field.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/map/lattice.hpp"

namespace backwash::reach {
namespace {

DisturbanceBound decoded(const BoundCodes& codes) noexcept {
  DisturbanceBound result;
  for (std::size_t d = 0; d < kDirections; ++d) result.w[d] = bound_of(codes[d]);
  return result;
}

}  // namespace

BoundField::BoundField(const map::OccupancyGrid& grid, const BoundModel& model, field::Extension extension)
    : origin_W_(grid.origin()),
      resolution_(grid.resolution()),
      tiles_(grid.size()),
      extension_(std::move(extension)),
      model_(model) {}

BoundField::BoundField(const map::OccupancyGrid& grid, const field::DisturbanceField& field, const BoundModel& model,
                       field::Extension extension)
    : BoundField(grid, model, std::move(extension)) {
  std::vector<std::size_t> listed;
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    if (field.has(grid.voxel(n))) listed.push_back(n);
  update(map::all_of(grid.size()), listed, [&](const auto& store) {
    for (const std::size_t n : listed) store(n, field.at(grid.voxel(n)));
  });
}

BoundCodes BoundField::coded(std::size_t n, const Variance& sigma) const noexcept {
  DisturbanceBound w = bound(sigma, model_);
  if (extension_.by_place()) {
    const Air air = extension_.at(map::voxel(tiles_.size(), n));
    for (std::size_t d = 0; d < kDirections; ++d) w.w[d] += d == kZ ? air.vertical : air.level;
  }
  BoundCodes result;
  std::ranges::transform(w.w, result.begin(), code_of);
  return result;
}

void BoundField::update(const map::VoxelBox& changed, std::span<const std::size_t> listed, const FillVariance& fill,
                        const Parallel& parallel) {
  const FillBounds bounds = [&](const auto& store) {
    fill([&](std::size_t n, const Variance& sigma) { store(n, coded(n, sigma)); });
  };
  tiles_.update(changed, listed, bounds, parallel);
  update_pushes();
}

void BoundField::restore(std::span<const std::size_t> listed, std::span<const BoundCodes> codes,
                         const Parallel& parallel) {
  const FillBounds kept = [&](const auto& store) {
    parallel(listed.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) store(listed[n], codes[n]);
    });
  };
  tiles_.update(map::all_of(tiles_.size()), listed, kept, parallel);
  update_pushes();
}

void BoundField::update_pushes() {
  if (!extension_.by_place()) return;
  least_push_ = largest_push_ = Vec3::Zero();
  unknown_level_ = unknown_vertical_ = 0;
  map::for_each_voxel(map::all_of(tiles_.size()), [&](const Index3& v) {
    if (!stored(v)) return;
    const Air air = extension_.at(v);
    least_push_ = least_push_.cwiseMin(air.push_W);
    largest_push_ = largest_push_.cwiseMax(air.push_W);
    unknown_level_ = std::max(unknown_level_, air.level);
    unknown_vertical_ = std::max(unknown_vertical_, air.vertical);
  });
}

DisturbanceBound BoundField::largest() const noexcept { return decoded(tiles_.largest()); }

// Laws of velocity are monotone in each component's size, so that their extremes are at ends or at rest.
FieldExtremes BoundField::extremes(double v_max) const noexcept {
  Vec3 least = Vec3::Zero(), most = Vec3::Zero();
  FieldExtremes found;
  double ln_variance = 0;
  for (int corner = 0; corner < 27; ++corner) {
    const Air air = extension_.moving(v_max * Vec3(corner % 3 - 1, corner / 3 % 3 - 1, corner / 9 - 1));
    least = least.cwiseMin(air.push_W);
    most = most.cwiseMax(air.push_W);
    found.level = std::max(found.level, air.level);
    found.vertical = std::max(found.vertical, air.vertical);
    ln_variance = std::max(ln_variance, air.ln_variance);
  }
  found.push_range = most - least + largest_push_ - least_push_;
  found.level += model_.mean_horizontal + unknown_level_;
  found.vertical += model_.mean_vertical + unknown_vertical_;
  found.gusts = largest();
  for (std::size_t d = 0; d < kDirections; ++d) {
    const double mean = d == kZ ? model_.mean_vertical : model_.mean_horizontal;
    found.gusts.w[d] = std::exp(ln_variance / 2) * std::max(0.0, found.gusts.w[d] - mean);
  }
  return found;
}

DisturbanceBound BoundField::max_without_push(const Vec3& v_W, const Vec3& low_W, const Vec3& high_W) const noexcept {
  const map::VoxelBox box = meeting(low_W, high_W);
  return max_without_push_over(v_W, box.low, box.high);
}

DisturbanceBound BoundField::max_without_push_over(const Vec3& v_W, const Index3& low,
                                                   const Index3& high) const noexcept {
  const DisturbanceBound found = max_over_voxels(low, high);
  return extension_.none() || !(found.w[kZ] > 0) ? found : moving(found, v_W);
}

// Closed voxels: one that only touches the box counts. Compared before the casts, so that any box is in range.
map::VoxelBox BoundField::meeting(const Vec3& low_W, const Vec3& high_W) const noexcept {
  map::VoxelBox box;
  Index3 &low = box.low, &high = box.high;
  for (int axis = 0; axis < 3; ++axis) {
    const double from = (low_W[axis] - origin_W_[axis]) / resolution_;
    const double to = (high_W[axis] - origin_W_[axis]) / resolution_;
    if (!(from <= tiles_.size()[axis]) || !(to >= 0)) return {Index3::Ones(), Index3::Zero()};
    low[axis] = from > 0 ? static_cast<int>(from) : 0;
    low[axis] -= from > 0 && low[axis] == from;
    high[axis] = to < tiles_.size()[axis] ? static_cast<int>(to) : tiles_.size()[axis] - 1;
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
  const map::VoxelBox box{low.cwiseMax(0), high.cwiseMin(tiles_.size() - Index3::Ones())};
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
  for (int k = std::max(box.low.z(), 0); extension_.by_place() && k <= std::min(box.high.z(), tiles_.size().z() - 1);
       ++k)
    for (int j = std::max(box.low.y(), 0); j <= std::min(box.high.y(), tiles_.size().y() - 1); ++j)
      for (int i = std::max(box.low.x(), 0); i <= std::min(box.high.x(), tiles_.size().x() - 1); ++i) {
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
  high = high.cwiseMin(tiles_.size() - Index3::Ones());
  if ((low.array() > high.array()).any()) return {};
  const int narrowest = (high - low).minCoeff() + 1;
  int level = 0;
  while (level + 1 < BoundTiles::kLevels && narrowest >= 2 << level) ++level;
  const int edge = 1 << level;
  // Cubes side by side; the last one of each row is moved back to end with the box.
  const Index3 end = high - Index3::Constant(edge - 1);
  BoundCodes maximum{};
  for (int k = low.z(); k <= high.z(); k += edge)
    for (int j = low.y(); j <= high.y(); j += edge)
      tiles_.raise_along(maximum, level, low.x(), end.x(), edge, std::min(j, end.y()), std::min(k, end.z()));
  return decoded(maximum);
}

DisturbanceBound BoundField::at(const Index3& v) const noexcept {
  return inside(v) ? decoded(tiles_.at(v).level[0]) : DisturbanceBound{};
}

}  // namespace backwash::reach

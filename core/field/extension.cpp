// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/extension.hpp"

#include <algorithm>

#include "core/map/lattice.hpp"

namespace backwash::field {
Air air_around(std::span<const ModelEffect> effects, const Around& around) {
  Air air;
  for (const ModelEffect& e : effects)
    if (const LawEntry& law = entry(e.kind); law.at) law.at(e, around, law.sight(e).level, air);
  return air;
}

Air air_moving(std::span<const ModelEffect> effects, const Vec3& v_W) noexcept {
  Air air;
  for (const ModelEffect& e : effects)
    if (const LawEntry& law = entry(e.kind); law.moving) law.moving(e, v_W, air);
  return air;
}

Extension::Extension(const map::OccupancyGrid& grid, const Model& model)
    : effects_(model.extension), origin_W_(grid.origin()), resolution_(grid.resolution()), size_(grid.size()) {
  for (const ModelEffect& e : effects_) {
    if (!entry(e.kind).sight) continue;
    const Sight sight = entry(e.kind).sight(e);
    sight_ = {std::max(sight_.down, sight.down), std::max(sight_.up, sight.up), std::max(sight_.level, sight.level)};
  }
  if (sight_.down + sight_.up + sight_.level > 0) voxels_.resize(grid.cell_count());
}

void Extension::fill(const map::OccupancyGrid& grid, std::span<const std::size_t> voxels) {
  if (!by_place()) return;
  for (const std::size_t n : voxels) {
    const Air air = air_around(effects_, around(grid, grid.center(grid.voxel(n)), sight_));
    const Eigen::Vector3f push = air.push_W.cast<float>();
    voxels_[n] = {{push.x(), push.y(), push.z()},
                  static_cast<float>(air.level),
                  static_cast<float>(air.vertical),
                  static_cast<float>(air.ln_variance),
                  true};
  }
}

Air Extension::at(const Index3& v) const noexcept {
  if (!by_place() || !map::inside(size_, v)) return {};
  const Stored& s = voxels_[map::linear(size_, v)];
  if (!s.set) return {};
  return {Vec3(s.push[0], s.push[1], s.push[2]), s.level, s.vertical, s.ln_variance};
}

Vec3 Extension::push(const Vec3& p_W, const Vec3& v_W) const noexcept {
  if (none()) return Vec3::Zero();
  Vec3 sum = Vec3::Zero();
  if (by_place()) {
    const Vec3 q = (p_W - origin_W_) / resolution_ - Vec3::Constant(0.5);
    // Beyond one voxel around the grid nothing is stored; also keeps the conversion to int within its range.
    const bool near = (q.array() > -1).all() && (q.array() < size_.array().cast<double>()).all();
    double weight = 0;
    const auto add = [&](const Index3& v, const Vec3& share) {
      if (!map::inside(size_, v)) return;
      const Stored& s = voxels_[map::linear(size_, v)];
      if (!s.set) return;
      weight += share.prod();
      sum += share.prod() * Vec3(s.push[0], s.push[1], s.push[2]);
    };
    if (near) map::for_corners(q, add);
    if (weight > 0) sum /= weight;
  }
  return sum + moving(v_W).push_W;
}

}  // namespace backwash::field

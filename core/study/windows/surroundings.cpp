// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/surroundings.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "core/map/lattice.hpp"
#include "core/study/windows/gates/window_rules.hpp"

namespace backwash::study {

MapView::MapView(const map::OccupancyGrid* grid, const Model& model)
    : grid_(grid), base_(model.base.horizontal, model.base.horizontal, model.base.vertical), tau_w_(model.bound.tau_w) {
  if (!grid_) return;
  field_.emplace(*grid_, model);
  low_ = grid_->origin();
  const Vec3 extent = grid_->resolution() * grid_->size().cast<double>();
  size_ = (extent / kWindowRules.sigma_lattice).array().ceil().cast<int>() + 2;
  lattice_.resize(static_cast<std::size_t>(size_.prod()));
  lattice_solid_.resize(lattice_.size());
}

bool MapView::near(const Vec3& p_W) const {
  if (!grid_) return (p_W.array().abs() < kWindowRules.room).all();
  const Vec3 high = low_ + grid_->resolution() * grid_->size().cast<double>();
  return (p_W.array() > low_.array() - kWindowRules.sight).all() &&
         (p_W.array() < high.array() + kWindowRules.sight).all();
}

PlaceAround MapView::around(const Vec3& p_W) const {
  if (!grid_) return {{p_W.z(), kNoSurface, {}}, {}};
  PlaceAround place{field::around(*grid_, p_W, {kWindowRules.sight_up, kWindowRules.sight_up, kWindowRules.sight}), {}};
  for (const auto& wall : place.walls)
    if (whole(p_W, place, wall)) place.whole_walls.push_back(wall);
  return place;
}

bool MapView::whole(const Vec3& p_W, const Around& around, const std::pair<double, Vec3>& wall) const {
  constexpr double kOpen = kWindowRules.whole_wall;
  const double a = grid_->resolution();
  const double down = std::isfinite(around.height) ? around.height : kOpen;
  const double up = std::isfinite(around.ceiling_gap) ? around.ceiling_gap : kOpen;
  const Vec3 inside = p_W + (wall.first + 0.5 * a) * wall.second;
  for (double z = p_W.z() - down + 0.5 * a; z < p_W.z() + up; z += a)
    if (!grid_->occupied(grid_->index(Vec3(inside.x(), inside.y(), z)))) return false;
  return true;
}

const Vec3& MapView::lattice_ln_sigma(const Index3& at) {
  auto& stored = lattice_[map::linear(size_, at)];
  if (!stored) {
    const Variance s = field_->at(low_ + kWindowRules.sigma_lattice * at.cast<double>()).sigma();
    stored = Vec3(s.xx, s.yy, s.zz).array().max(kWindowRules.sigma_least).log().matrix();
  }
  return *stored;
}

bool MapView::lattice_in_solid(const Index3& at) {
  auto& stored = lattice_solid_[map::linear(size_, at)];
  if (stored) return *stored;
  stored = false;
  for (const int x : {-1, 1})
    for (const int y : {-1, 1})
      for (const int z : {-1, 1}) {
        const Vec3 beside = at.cast<double>() + kWindowRules.corner_least * Vec3(x, y, z);
        stored = *stored || inside_solid(low_ + kWindowRules.sigma_lattice * beside);
      }
  return *stored;
}

Vec3 MapView::sigma(const Vec3& p_W) {
  if (!field_) return base_;
  const auto exactly = [this](const Vec3& at_W) -> Vec3 {
    const Variance s = field_->at(at_W).sigma();
    return {s.xx, s.yy, s.zz};
  };
  const Vec3 q = (p_W - low_) / kWindowRules.sigma_lattice;
  const Index3 corner = q.array().floor().cast<int>();
  if ((corner.array() < 0).any() || ((corner + Index3::Ones()).array() >= size_.array()).any()) {
    return exactly(p_W);
  }
  Vec3 ln = Vec3::Zero();
  double free = 0;
  const bool buried = inside_solid(p_W);
  map::for_corners(q, [&](const Index3& v, const Vec3& share) {
    if (!(share.prod() > kWindowRules.corner_least)) return;
    if (!buried && lattice_in_solid(v)) return;
    ln += share.prod() * lattice_ln_sigma(v);
    free += share.prod();
  });
  return free > 0 ? Vec3((ln / free).array().exp()) : exactly(p_W);
}

}  // namespace backwash::study

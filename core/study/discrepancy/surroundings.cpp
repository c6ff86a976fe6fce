// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/discrepancy/surroundings.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace backwash::study::discrepancy {

Surroundings::Surroundings(const map::OccupancyGrid* grid, const Model& model)
    : grid_(grid), base_(model.base.horizontal, model.base.horizontal, model.base.vertical) {
  if (!grid_) return;
  field_.emplace(*grid_, model);
  low_ = grid_->origin();
  const Vec3 extent = grid_->resolution() * grid_->size().cast<double>();
  size_ = (extent / kLattice).array().ceil().cast<int>() + 2;
  lattice_.resize(static_cast<std::size_t>(size_.prod()));
}

double Surroundings::ray(const Vec3& from, const Vec3& direction, double range) const {
  const double a = grid_->resolution();
  Index3 v = grid_->index(from), step;
  Vec3 next, per;
  for (int i = 0; i < 3; ++i) {
    step[i] = direction[i] >= 0 ? 1 : -1;
    per[i] = std::abs(direction[i]) > 1e-12 ? a / std::abs(direction[i]) : kNoSurface;
    const double face = grid_->origin()[i] + a * (v[i] + (step[i] > 0 ? 1 : 0));
    next[i] = std::isfinite(per[i]) ? (face - from[i]) / direction[i] : kNoSurface;
  }
  double at = 0;
  while (at <= range) {
    if (grid_->occupied(v)) return at;
    int axis = 0;
    at = next.minCoeff(&axis);
    v[axis] += step[axis];
    next[axis] += per[axis];
  }
  return kNoSurface;
}

Around Surroundings::around(const Vec3& p_W) const {
  if (!grid_) return {p_W.z(), kNoSurface, {}};
  constexpr std::size_t kRays = 32;
  Around found{ray(p_W, -Vec3::UnitZ(), 20), ray(p_W, Vec3::UnitZ(), 20), {}};
  std::array<double, kRays> d;
  const auto direction = [](std::size_t k) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(k) / kRays;
    return Vec3(std::cos(angle), std::sin(angle), 0);
  };
  for (std::size_t k = 0; k < kRays; ++k) d[k] = ray(p_W, direction(k), kSight);
  for (std::size_t k = 0; k < kRays; ++k) {
    const double before = d[(k + kRays - 1) % kRays], after = d[(k + 1) % kRays];
    if (std::isfinite(d[k]) && d[k] < before && d[k] <= after) found.walls.emplace_back(d[k], direction(k));
  }
  return found;
}

const Vec3& Surroundings::lattice_sigma(const Index3& at) {
  auto& stored = lattice_[static_cast<std::size_t>(at.x() + size_.x() * (at.y() + size_.y() * at.z()))];
  if (!stored) {
    const Variance s = field_->at(low_ + kLattice * at.cast<double>()).sigma();
    stored = Vec3(s.xx, s.yy, s.zz);
  }
  return *stored;
}

Vec3 Surroundings::sigma(const Vec3& p_W) {
  if (!field_) return base_;
  const Vec3 q = (p_W - low_) / kLattice;
  const Index3 corner = q.array().floor().cast<int>();
  if ((corner.array() < 0).any() || ((corner + Index3::Ones()).array() >= size_.array()).any()) {
    const Variance s = field_->at(p_W).sigma();
    return {s.xx, s.yy, s.zz};
  }
  const Vec3 f = q - corner.cast<double>();
  Vec3 ln = Vec3::Zero();
  for (int n = 0; n < 8; ++n) {
    const Index3 bit(n & 1, (n >> 1) & 1, n >> 2);
    double weight = 1;
    for (int i = 0; i < 3; ++i) weight *= bit[i] ? f[i] : 1 - f[i];
    if (weight > 1e-9) ln += weight * lattice_sigma(corner + bit).array().max(1e-9).log().matrix();
  }
  return ln.array().exp();
}

}  // namespace backwash::study::discrepancy

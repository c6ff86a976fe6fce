// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/model_field.hpp"

#include <algorithm>

#include "core/map/lattice.hpp"

namespace backwash::sim {
namespace {

Model without_extension(Model model) {
  model.extension.clear();
  return model;
}

/// 21 bits an axis: 200 km of lattice.
std::uint64_t key(const Index3& v) {
  std::uint64_t k = 0;
  for (int i = 0; i < 3; ++i) k = k << 21 | (static_cast<std::uint64_t>(v[i] + (1 << 20)) & 0x1fffff);
  return k;
}

}  // namespace

ModelField::ModelField(const map::OccupancyGrid& grid, const Model& model)
    : grid_(&grid), field_(grid, without_extension(model)) {}

const Variance& ModelField::at(const Index3& lattice) {
  const auto [entry, fresh] = known_.try_emplace(key(lattice));
  if (fresh) entry->second = field_.at(kLattice * lattice.cast<double>()).sigma();
  return entry->second;
}

Variance ModelField::sigma(const Vec3& p_W) {
  const Vec3 q = (p_W / kLattice).cwiseMax(-1e6).cwiseMin(1e6);
  Variance sum;
  double weight = 0;
  map::for_corners(q, [&](const Index3& v, const Vec3& shares) {
    const double share = shares.prod();
    if (!(share > 1e-9) || grid_->occupied(grid_->index(kLattice * v.cast<double>()))) return;
    sum += share * at(v);
    weight += share;
  });
  return weight > 0 ? 1 / weight * sum : field_.at(p_W).sigma();
}

}  // namespace backwash::sim

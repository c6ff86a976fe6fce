// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/world/air_scale.hpp"

#include <utility>

#include "core/field/field_update.hpp"

namespace backwash::plan {
namespace {

Model ground_alone(Model model) {
  model.base = {0, 0};
  model.wall.k1 = {0, 0, 0};
  model.corner.lambda = {0, 0, 0};
  return model;
}
Model walls_alone(Model model) {
  model.base = {0, 0};
  model.ground.lambda = {0, 0};
  model.ground.k1 = {0, 0};
  model.corner.lambda = {0, 0, 0};
  return model;
}

}  // namespace

void AirScale::update(const map::OccupancyGrid& grid, const Model& model, const map::VoxelBox& columns,
                      std::span<const std::size_t> voxels, std::span<const std::size_t> inside,
                      const Parallel& parallel) {
  field::DisturbanceField all =
      sigma ? field::DisturbanceField(grid, voxels, *sigma, columns) : field::DisturbanceField(grid, voxels);
  field::DisturbanceField ground(grid, inside), walls(grid, inside);
  const auto fill = [&](field::DisturbanceField& field, const Model& of) {
    const auto store = [&](const Index3& v, const Variance& s) { field.set(grid.linear(v), s); };
    field::evaluate_columns(grid, of, columns, inside, store, parallel);
  };
  fill(all, model);
  fill(ground, ground_alone(model));
  fill(walls, walls_alone(model));
  const auto base = Variance::horizontal_vertical(model.base.horizontal, model.base.vertical);
  classes.resize(grid.cell_count(), AirClass::none);
  for (const std::size_t n : inside) {
    const Index3 v = grid.voxel(n);
    const Variance up = ground.at(v), beside = walls.at(v);
    classes[n] = dominant(base, up, beside, all.at(v) + (-1.0) * (base + up + beside));
  }
  sigma = std::move(all);
}

// In single precision, as Σ is stored.
Variance AirScale::flown_at(std::size_t n) const noexcept {
  const Variance s = sigma->at(n);
  const auto factor = static_cast<float>(factor_of(factors, classes[n]));
  const auto scaled = [factor](double of_s) { return static_cast<double>(factor * static_cast<float>(of_s)); };
  return {scaled(s.xx), scaled(s.xy), 0, scaled(s.yy), 0, scaled(s.zz)};
}

AirPlace air_at(const AirScale& scale, const map::OccupancyGrid& grid, const Vec3& p_W) noexcept {
  if (!scale.known()) return {};
  const Variance s = scale.sigma->interpolated(p_W, {});
  const Index3 v = grid.index(p_W);
  return {{s.xx, s.yy, s.zz}, grid.inside(v) ? scale.classes[grid.linear(v)] : AirClass::none};
}

}  // namespace backwash::plan

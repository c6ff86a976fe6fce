// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/world/air_scale.hpp"

#include <utility>

#include "core/field/field_update.hpp"
#include "core/field/whole_field.hpp"

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

/// Σ of a model at the listed voxels of some columns, from what can reach them alone.
void fill_columns(field::DisturbanceField& field, const map::OccupancyGrid& grid, const Model& model,
                  const map::VoxelBox& columns, std::span<const std::size_t> listed, const Parallel& parallel) {
  map::VoxelBox around = field::affected_columns(grid, model, columns);
  if (model.unknown_floor) around.low.z() = -1;  // what is below the map is unknown, too
  const map::OccupancyGrid part = map::part_of(grid, around);
  std::vector<std::size_t> of_part;
  of_part.reserve(listed.size());
  for (const std::size_t n : listed) of_part.push_back(part.linear(grid.voxel(n) - around.low));
  const field::WholeField sweep(part, model, of_part);
  parallel(sweep.block_count(),
           [&](std::size_t begin, std::size_t end) { field.fill(sweep, part, around.low, begin, end); });
}

}  // namespace

void AirScale::update(const map::OccupancyGrid& grid, const Model& model, const map::VoxelBox& columns,
                      std::span<const std::size_t> voxels, std::span<const std::size_t> inside,
                      const Parallel& parallel) {
  field::DisturbanceField all =
      sigma ? field::DisturbanceField(grid, voxels, *sigma, columns) : field::DisturbanceField(grid, voxels);
  field::DisturbanceField ground(grid, inside), walls(grid, inside);
  fill_columns(all, grid, model, columns, inside, parallel);
  fill_columns(ground, grid, ground_alone(model), columns, inside, parallel);
  fill_columns(walls, grid, walls_alone(model), columns, inside, parallel);
  const auto base = Variance::horizontal_vertical(model.base.horizontal, model.base.vertical);
  classes.resize(grid.cell_count(), AirClass::none);
  for (const std::size_t n : inside) {
    const Index3 v = grid.voxel(n);
    const Variance up = ground.at(v), beside = walls.at(v);
    classes[n] = dominant(base, up, beside, all.at(v) + (-1.0) * (base + up + beside));
  }
  sigma = std::move(all);
}

field::DisturbanceField AirScale::flown() const {
  field::DisturbanceField rougher = *sigma;
  if (factors != kModelledAir) rougher.scale(classes, factors);
  return rougher;
}

// In single precision, as the field is scaled.
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

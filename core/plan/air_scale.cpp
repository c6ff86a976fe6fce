// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/air_scale.hpp"

namespace backwash::plan {
namespace {

Model ground_alone(Model model) {
  model.base = {0, 0}, model.wall.k1 = {0, 0, 0}, model.corner.lambda = {0, 0, 0};
  return model;
}
Model walls_alone(Model model) {
  model.base = {0, 0}, model.ground.lambda = {0, 0}, model.ground.k1 = {0, 0}, model.corner.lambda = {0, 0, 0};
  return model;
}

}  // namespace

void AirScale::classify(const map::OccupancyGrid& grid, const field::DisturbanceField& sigma, const Model& model,
                        std::span<const std::size_t> voxels, const FillField& fill) {
  field::DisturbanceField ground(grid, voxels), walls(grid, voxels);
  fill(ground, ground_alone(model));
  fill(walls, walls_alone(model));
  const auto base = Variance::horizontal_vertical(model.base.horizontal, model.base.vertical);
  classes.resize(grid.cell_count(), AirClass::none);
  for (const std::size_t n : voxels) {
    const Index3 v = grid.voxel(n);
    const Variance up = ground.at(v), beside = walls.at(v);
    classes[n] = dominant(base, up, beside, sigma.at(v) + (-1.0) * (base + up + beside));
  }
}

std::optional<field::DisturbanceField> AirScale::flown(const field::DisturbanceField& sigma) const {
  if (factors == kModelledAir) return std::nullopt;
  field::DisturbanceField rougher = sigma;
  rougher.scale(classes, factors);
  return rougher;
}

AirPlace air_at(const AirScale& scale, const map::OccupancyGrid& grid, const field::DisturbanceField& sigma,
                const Vec3& p_W) noexcept {
  const Variance s = sigma.interpolated(p_W, {});
  const Index3 v = grid.index(p_W);
  return {{s.xx, s.yy, s.zz}, scale.known() && grid.inside(v) ? scale.classes[grid.linear(v)] : AirClass::none};
}

}  // namespace backwash::plan

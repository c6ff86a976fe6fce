// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/world.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

namespace backwash::plan {
namespace {

/// Free voxels that hold a point at which the vehicle's centre can be: farther from obstacles than its body's radius,
/// less the half diagonal by which such a point may lie off the voxel's centre.
std::vector<std::size_t> voxels_for_centre(const map::OccupancyGrid& grid, const map::DistanceField& distance,
                                           const Vehicle& vehicle) {
  const double least = vehicle.body.radius - grid.resolution() * std::sqrt(3.0) / 2;
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    if (grid.at(n) == map::Cell::free && distance.at(grid.voxel(n)) >= least) voxels.push_back(n);
  }
  return voxels;
}

/// The voxels of `voxels` within a box.
std::vector<std::size_t> within(const map::OccupancyGrid& grid, std::vector<std::size_t> voxels,
                                const map::VoxelBox& box) {
  std::erase_if(voxels, [&](std::size_t n) {
    const Index3 v = grid.voxel(n);
    return (v.array() < box.low.array()).any() || (v.array() > box.high.array()).any();
  });
  return voxels;
}

map::VoxelBox grown(const map::VoxelBox& box, const Index3& by, const Index3& size) {
  return {(box.low - by).cwiseMax(0), (box.high + by).cwiseMin(size - Index3::Ones())};
}

/// Where Σ can change: within every term's range and the elements' own neighbourhood (normals look two voxels around)
/// of the change, along z everywhere, since a corner lies as deep as its column is free.
map::VoxelBox reached_by_field(const map::OccupancyGrid& grid, const Model& model, const map::VoxelBox& changed) {
  const double range = std::max({model.ground.l_max, model.corner.l_max, model.wall.l_max, model.ground.r0});
  const int voxels = static_cast<int>(std::ceil(range / grid.resolution())) + 4;
  return grown(changed, {voxels, voxels, grid.size().z()}, grid.size());
}

/// Where the hover map can change: a set reads w̄ over itself, and obstacles up to 1 m (the cap of its clearance) and
/// the body around it. No set is wider than the largest bound of all makes it.
map::VoxelBox reached_by_hover(const World& world, const reach::BoundField& bounds, const map::VoxelBox& field,
                               const map::VoxelBox& changed) {
  const auto& grid = world.grid;
  const Vec3 far = grid.origin() + grid.resolution() * grid.size().cast<double>();
  const auto after = bounds.max_over(grid.origin(), far), before = world.bounds.max_over(grid.origin(), far);
  const double w = std::max(std::ranges::max(after.w), std::ranges::max(before.w));
  const double h =
      std::max(w * std::max(world.reach.horizontal.h_inf, world.reach.vertical.h_inf), world.constant_margin);
  const auto& vehicle = world.reach.vehicle;
  const auto voxels = [&](double metres) {
    return Index3::Constant(static_cast<int>(std::ceil(metres / grid.resolution())) + 2).eval();
  };
  map::VoxelBox box = grown(field, voxels(h), grid.size());
  const map::VoxelBox near =
      grown(changed, voxels(1 + vehicle.body.radius + vehicle.estimation.position + 2 * h), grid.size());
  box.add(near.low);
  box.add(near.high);
  return box;
}

Model with_vehicle(const Model& model, const Vehicle& vehicle) {
  Model result = model;
  result.ground.r0 = vehicle.body.diagonal_radius;
  return result;
}

}  // namespace

void run_serial(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) { work(0, count); }

std::shared_ptr<const World> build_world(map::OccupancyGrid grid, const Model& model, const Vehicle& vehicle,
                                         reach::Method method, double constant_margin, const Parallel& parallel) {
  const Model vehicle_model = with_vehicle(model, vehicle);
  // The paper's sets exist for its second-order loop only.
  const reach::Loop loop = method == reach::Method::paper ? reach::Loop::continuous : reach::Loop::vehicle;
  reach::Reachability reach(vehicle, method, loop);
  map::DistanceField distance(grid);

  const std::vector<std::size_t> voxels = voxels_for_centre(grid, distance, vehicle);
  field::DisturbanceField field(grid);
  const field::WholeField whole(grid, vehicle_model, voxels);
  parallel(whole.tile_count(), [&](std::size_t begin, std::size_t end) { field.fill(whole, begin, end); });

  reach::BoundField bounds(grid, field, model.bound);
  reach::HoverMap hover(grid);
  parallel(voxels.size(), [&](std::size_t begin, std::size_t end) {
    hover.fill(reach, grid, distance, bounds, std::span(voxels).subspan(begin, end - begin), constant_margin);
  });
  return std::make_shared<const World>(World{std::move(grid), std::move(distance), std::move(field), std::move(bounds),
                                             std::move(hover), std::move(reach), constant_margin});
}

std::shared_ptr<const World> update_world(const World& old, map::OccupancyGrid grid, const map::VoxelBox& changed,
                                          const Model& model, const Parallel& parallel) {
  if (changed.empty()) return std::make_shared<const World>(old);
  const Model vehicle_model = with_vehicle(model, old.reach.vehicle);
  map::DistanceField distance(grid);
  const std::vector<std::size_t> voxels = voxels_for_centre(grid, distance, old.reach.vehicle);

  const map::VoxelBox field_box = reached_by_field(grid, vehicle_model, changed);
  const std::vector<std::size_t> field_voxels = within(grid, voxels, field_box);
  field::DisturbanceField field = old.field;
  field.clear(field_box);
  const field::WholeField whole(grid, vehicle_model, field_voxels);
  parallel(whole.tile_count(), [&](std::size_t begin, std::size_t end) { field.fill(whole, begin, end); });

  reach::BoundField bounds(grid, field, model.bound);
  const map::VoxelBox hover_box = reached_by_hover(old, bounds, field_box, changed);
  const std::vector<std::size_t> hover_voxels = within(grid, voxels, hover_box);
  reach::HoverMap hover = old.hover;
  hover.clear(hover_box);
  parallel(hover_voxels.size(), [&](std::size_t begin, std::size_t end) {
    hover.fill(old.reach, grid, distance, bounds, std::span(hover_voxels).subspan(begin, end - begin),
               old.constant_margin);
  });
  return std::make_shared<const World>(World{std::move(grid), std::move(distance), std::move(field), std::move(bounds),
                                             std::move(hover), old.reach, old.constant_margin});
}

}  // namespace backwash::plan

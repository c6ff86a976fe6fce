// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/world.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "core/field/field_update.hpp"

namespace backwash::plan {
namespace {

map::VoxelBox grown(const map::VoxelBox& box, const Index3& by, const Index3& size) {
  return {(box.low - by).cwiseMax(0), (box.high + by).cwiseMin(size - Index3::Ones())};
}

/// Stores Σ at the listed voxels.
void fill_field(field::DisturbanceField& field, const map::OccupancyGrid& grid, const Model& model,
                std::span<const std::size_t> voxels, const Parallel& parallel) {
  const field::WholeField whole(grid, model, voxels);
  parallel(whole.block_count(), [&](std::size_t begin, std::size_t end) { field.fill(whole, begin, end); });
}

/// Stores Σ at the listed voxels of some columns, from what can reach them alone.
void fill_columns(field::DisturbanceField& field, const map::OccupancyGrid& grid, const Model& model,
                  const map::VoxelBox& columns, std::span<const std::size_t> voxels, const Parallel& parallel) {
  const map::VoxelBox around = field::affected_columns(grid, model, columns);
  const map::OccupancyGrid part = map::part_of(grid, around);
  std::vector<std::size_t> listed;
  listed.reserve(voxels.size());
  for (const std::size_t n : voxels) listed.push_back(part.linear(grid.voxel(n) - around.low));
  const field::WholeField whole(part, model, listed);
  parallel(whole.block_count(),
           [&](std::size_t begin, std::size_t end) { field.fill(whole, part, around.low, begin, end); });
}

/// The classes of air, found again in some columns.
AirScale classified(AirScale air, const map::OccupancyGrid& grid, const field::DisturbanceField& field,
                    const Model& model, const map::VoxelBox& columns, std::span<const std::size_t> voxels,
                    const Parallel& parallel) {
  if (!air.known()) return air;
  const std::vector<std::size_t> inside = field::voxels_within(grid, voxels, columns);
  air.classify(grid, field, model, inside, [&](field::DisturbanceField& to, const Model& term) {
    fill_columns(to, grid, term, columns, inside, parallel);
  });
  return air;
}

/// Stores a model's extension at voxels where it may have changed, and multiplies Σ where it was computed anew.
void extend(field::Extension& air, field::DisturbanceField& field, const map::OccupancyGrid& grid,
            std::span<const std::size_t> moved, std::span<const std::size_t> fresh, const Parallel& parallel) {
  if (!air.by_place()) return;
  parallel(moved.size(),
           [&](std::size_t begin, std::size_t end) { air.fill(grid, moved.subspan(begin, end - begin)); });
  field.scale(air, fresh);
}

/// Where the hover map can change: a set reads w̄ over itself, and obstacles up to 1 m (the cap of its clearance) and
/// the body around it. No set is wider than the largest bound of all makes it.
map::VoxelBox reached_by_hover(const World& world, const reach::BoundField& bounds, const map::VoxelBox& field,
                               const map::VoxelBox& changed) {
  const auto& grid = world.grid;
  const Vec3 far = grid.origin() + grid.resolution() * grid.size().cast<double>();
  const auto after = bounds.max_over(grid.origin(), far), before = world.bounds.max_over(grid.origin(), far);
  const double w = std::max(std::ranges::max(after.w), std::ranges::max(before.w));
  const double h = std::max(w * std::max(world.reach.horizontal.h_inf, world.reach.vertical.h_inf),
                            world.constant_margin.value_or(0.0));
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

}  // namespace

std::vector<std::size_t> voxels_for_centre(const map::OccupancyGrid& grid, const map::DistanceField& distance,
                                           const Vehicle& vehicle) {
  const double least = vehicle.body.radius - grid.resolution() * std::sqrt(3.0) / 2;
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    if (grid.at(n) == map::Cell::free && distance.at(n) >= least) voxels.push_back(n);
  }
  return voxels;
}

Model with_vehicle(const Model& model, const Vehicle& vehicle) {
  Model result = model;
  result.ground.r0 = vehicle.body.diagonal_radius;
  return result;
}

reach::Reachability sets_of(const Vehicle& vehicle, reach::Method method) {
  return {vehicle, method, method == reach::Method::paper ? reach::Loop::continuous : reach::Loop::vehicle};
}

void run_serial(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) { work(0, count); }

std::shared_ptr<const World> build_world(map::OccupancyGrid grid, const Model& model, const Vehicle& vehicle,
                                         reach::Method method, std::optional<double> constant_margin,
                                         const Parallel& parallel) {
  const Model vehicle_model = with_vehicle(model, vehicle);
  reach::Reachability reach = sets_of(vehicle, method);
  map::DistanceField distance(grid);
  map::OccupancySums sums(grid);

  const std::vector<std::size_t> voxels = voxels_for_centre(grid, distance, vehicle);
  field::DisturbanceField field(grid, voxels);
  fill_field(field, grid, vehicle_model, voxels, parallel);
  field::Extension air(grid, vehicle_model);
  extend(air, field, grid, voxels, voxels, parallel);

  reach::BoundField bounds(grid, field, model.bound, std::move(air));
  reach::HoverMap hover(grid);
  parallel(voxels.size(), [&](std::size_t begin, std::size_t end) {
    hover.fill(reach, grid, distance, sums, bounds, std::span(voxels).subspan(begin, end - begin), constant_margin);
  });
  SafeSpace safe(hover.safe_voxels());
  CentreResponse response(vehicle, reach.loop);
  return std::make_shared<const World>(World{std::move(grid), std::move(distance), std::move(sums), std::move(field),
                                             std::move(bounds), std::move(hover), std::move(safe), std::move(reach),
                                             std::move(response), constant_margin});
}

World with_clearance_by(World world, reach::Method method, std::optional<double> constant_margin,
                        const Parallel& parallel) {
  const Vehicle vehicle = world.reach.vehicle;
  world.reach = sets_of(vehicle, method);
  world.response = CentreResponse(vehicle, world.reach.loop);
  world.constant_margin = constant_margin;
  const std::vector<std::size_t> voxels = voxels_for_centre(world.grid, world.distance, vehicle);
  world.hover = reach::HoverMap(world.grid);
  parallel(voxels.size(), [&](std::size_t begin, std::size_t end) {
    world.hover.fill(world.reach, world.grid, world.distance, world.sums, world.bounds,
                     std::span(voxels).subspan(begin, end - begin), constant_margin);
  });
  world.safe = SafeSpace(world.hover.safe_voxels());
  return world;
}

std::shared_ptr<const World> with_air(const World& old, const AirFactors& factors, const Model& model,
                                      const Parallel& parallel) {
  World world = old;
  if (!world.air.known()) {
    const std::vector<std::size_t> voxels = voxels_for_centre(world.grid, world.distance, world.reach.vehicle);
    world.air.classify(
        world.grid, world.field, with_vehicle(model, world.reach.vehicle), voxels,
        [&](field::DisturbanceField& to, const Model& term) { fill_field(to, world.grid, term, voxels, parallel); });
  }
  if (world.air.factors == factors) return std::make_shared<const World>(std::move(world));
  world.air.factors = factors;
  const auto rougher = world.air.flown(world.field);
  world.bounds = reach::BoundField(world.grid, rougher ? *rougher : world.field, model.bound, old.bounds.extension());
  const reach::Method method = world.reach.method;
  const std::optional<double> margin = world.constant_margin;
  return std::make_shared<const World>(with_clearance_by(std::move(world), method, margin, parallel));
}

std::shared_ptr<const World> update_world(const World& old, map::OccupancyGrid grid, const map::VoxelBox& changed,
                                          const Model& model, const Parallel& parallel) {
  if (changed.empty()) return std::make_shared<const World>(old);
  const Model vehicle_model = with_vehicle(model, old.reach.vehicle);
  map::DistanceField distance = old.distance;
  distance.update(grid, changed);
  map::OccupancySums sums = old.sums;
  sums.update(grid, changed.low, changed.high);
  const std::vector<std::size_t> voxels = voxels_for_centre(grid, distance, old.reach.vehicle);

  map::VoxelBox columns = field::affected_columns(grid, vehicle_model, changed);
  // A wide body's centre gets places, or loses them, beyond the field's range.
  const int body = static_cast<int>(std::ceil(old.reach.vehicle.body.radius / grid.resolution())) + 1;
  const map::VoxelBox beside = grown(changed, {body, body, grid.size().z()}, grid.size());
  columns.add(beside.low), columns.add(beside.high);
  field::DisturbanceField field(grid, voxels, old.field, columns);
  fill_columns(field, grid, vehicle_model, columns, field::voxels_within(grid, voxels, columns), parallel);

  field::Extension air = old.bounds.extension();
  const auto sideways = static_cast<int>(std::ceil(air.level_range() / grid.resolution())) + 1;
  map::VoxelBox moved = grown(changed, {sideways, sideways, grid.size().z()}, grid.size());
  moved.add(columns.low), moved.add(columns.high);
  extend(air, field, grid, field::voxels_within(grid, voxels, moved), field::voxels_within(grid, voxels, columns),
         parallel);
  const bool everywhere = air.by_place();  // pushes of anywhere widen the largest sets

  AirScale scale = classified(old.air, grid, field, vehicle_model, columns, voxels, parallel);
  const auto rougher = scale.flown(field);
  const field::DisturbanceField& flown = rougher ? *rougher : field;
  reach::BoundField bounds = everywhere ? reach::BoundField(grid, flown, model.bound, std::move(air))
                                        : reach::BoundField(old.bounds, flown, columns);
  const map::VoxelBox hover_box = everywhere ? map::VoxelBox{Index3::Zero(), grid.size() - Index3::Ones()}
                                             : reached_by_hover(old, bounds, columns, changed);
  const std::vector<std::size_t> hover_voxels = field::voxels_within(grid, voxels, hover_box);
  reach::HoverMap hover = old.hover;
  hover.clear(hover_box);
  parallel(hover_voxels.size(), [&](std::size_t begin, std::size_t end) {
    hover.fill(old.reach, grid, distance, sums, bounds, std::span(hover_voxels).subspan(begin, end - begin),
               old.constant_margin);
  });
  SafeSpace safe(hover.safe_voxels());
  return std::make_shared<const World>(World{std::move(grid), std::move(distance), std::move(sums), std::move(field),
                                             std::move(bounds), std::move(hover), std::move(safe), old.reach,
                                             old.response, old.constant_margin, std::move(scale)});
}

}  // namespace backwash::plan

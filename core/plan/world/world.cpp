// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/world/world.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "core/field/field_update.hpp"
#include "core/field/whole_field.hpp"

namespace backwash::plan {
namespace {

map::VoxelBox grown(const map::VoxelBox& box, const Index3& by, const Index3& size) {
  return {(box.low - by).cwiseMax(0), (box.high + by).cwiseMin(size - Index3::Ones())};
}

/// The grid's columns, in pieces of about 300 × 300: what is needed besides the world itself is that of one piece.
std::vector<map::VoxelBox> pieces(const Index3& size) {
  constexpr int kMost = 320;  // voxels
  const auto parts = [](int n) { return (n + kMost - 1) / kMost; };
  const int nx = parts(size.x()), ny = parts(size.y());
  std::vector<map::VoxelBox> result;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      result.push_back({{size.x() * i / nx, size.y() * j / ny, 0},
                        {size.x() * (i + 1) / nx - 1, size.y() * (j + 1) / ny - 1, size.z() - 1}});
  return result;
}

/// Bounds of Σ, evaluated anew in whole columns from what can reach them alone. `whole`: the map in which that is; the
/// grid of `bounds` is a part of it, from its voxel `low` on. Columns and listed voxels are those of the part.
void update_bounds(reach::BoundField& bounds, const map::OccupancyGrid& whole, const Index3& low, const Index3& size,
                   const Model& model, const map::VoxelBox& columns, std::span<const std::size_t> listed,
                   const Parallel& parallel) {
  map::VoxelBox around = field::affected_columns(whole, model, {low + columns.low, low + columns.high});
  if (model.unknown_floor) around.low.z() = -1;  // what is below the map is unknown, too
  const map::OccupancyGrid reached = map::part_of(whole, around);
  const Index3 shift = low - around.low;
  std::vector<std::size_t> of_reached;
  of_reached.reserve(listed.size());
  for (const std::size_t n : listed) of_reached.push_back(reached.linear(map::voxel(size, n) + shift));
  const field::WholeField sweep(reached, model, of_reached);
  const field::Extension& air = bounds.extension();
  const auto fill = [&](const auto& store) {
    parallel(sweep.block_count(), [&](std::size_t begin, std::size_t end) {
      sweep.evaluate(begin, end, [&](std::size_t n, const Variance& s) {
        const Index3 v = reached.voxel(n) - shift;
        const auto factor = air.by_place() ? static_cast<float>(std::exp(air.at(v).ln_variance)) : 1.f;
        const auto single = [factor](double of_s) { return factor * static_cast<float>(of_s); };
        store(map::linear(size, v), Variance{single(s.xx), single(s.xy), 0, single(s.yy), 0, single(s.zz)});
      });
    });
  };
  bounds.update(columns, listed, fill, parallel);
}

/// Stores a model's extension at the listed voxels.
void fill_air(field::Extension& air, const map::OccupancyGrid& grid, std::span<const std::size_t> listed,
              const Parallel& parallel) {
  parallel(listed.size(),
           [&](std::size_t begin, std::size_t end) { air.fill(grid, listed.subspan(begin, end - begin)); });
}

/// The free voxels, linear, in rising order.
std::vector<std::size_t> voxels_where(const map::OccupancyGrid& free) {
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < free.cell_count(); ++n)
    if (free.at(n) == map::Cell::free) voxels.push_back(n);
  return voxels;
}

/// Where hovering is safe, at the listed voxels.
void fill_hover(reach::HoverMap& hover, const reach::Reachability& reach, const map::OccupancyGrid& grid,
                const map::DistanceField& distance, const map::OccupancySums& sums, const reach::BoundField& bounds,
                std::span<const std::size_t> listed, std::optional<double> constant_margin, const Parallel& parallel) {
  parallel(listed.size(), [&](std::size_t begin, std::size_t end) {
    hover.fill(reach, grid, distance, sums, bounds, listed.subspan(begin, end - begin), constant_margin);
  });
}

/// Where the hover map can change: a set reads w̄ over itself, and obstacles up to 1 m (the cap of its clearance) and
/// the body around it. No set is wider than the largest bound of all makes it.
map::VoxelBox reached_by_hover(const World& world, const reach::BoundField& bounds, const map::VoxelBox& field,
                               const map::VoxelBox& changed) {
  const auto& grid = world.grid;
  const auto after = bounds.largest(), before = world.bounds.largest();
  const double w = std::max(std::ranges::max(after.w), std::ranges::max(before.w));
  const double h = std::max(w * std::max(world.reach.horizontal.h_inf, world.reach.vertical.h_inf),
                            world.constant_margin.value_or(0.0));
  const auto& vehicle = world.reach.vehicle;
  const auto voxels = [&](double metres) {  // of an infinite bound, or one that is no number: all
    const double most = grid.size().maxCoeff(), count = std::ceil(metres / grid.resolution());
    return Index3::Constant(static_cast<int>(count < most ? count : most) + 2).eval();
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
                                           const Vehicle& vehicle, const map::VoxelBox& box) {
  const double least = vehicle.body.radius - grid.resolution() * std::sqrt(3.0) / 2;
  std::vector<std::size_t> voxels;
  for (int k = box.low.z(); k <= box.high.z(); ++k)
    for (int j = box.low.y(); j <= box.high.y(); ++j) {
      std::size_t n = grid.linear({box.low.x(), j, k});
      for (int i = box.low.x(); i <= box.high.x(); ++i, ++n)
        if (grid.at(n) == map::Cell::free && distance.at({i, j, k}) >= least) voxels.push_back(n);
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

namespace {

/// The world of a grid, or of one that is a part of a whole map from its voxel `low` on.
std::shared_ptr<const World> build(const map::OccupancyGrid* whole, const Index3& low, map::OccupancyGrid grid,
                                   const Model& model, const Vehicle& vehicle, reach::Method method,
                                   std::optional<double> constant_margin, const Parallel& parallel) {
  const Model vehicle_model = with_vehicle(model, vehicle);
  reach::Reachability reach = sets_of(vehicle, method);
  map::DistanceField distance(grid);
  map::OccupancySums sums(grid);
  const auto listed = [&](const map::VoxelBox& box) { return voxels_for_centre(grid, distance, vehicle, box); };

  field::Extension air(grid, vehicle_model);
  if (air.by_place()) fill_air(air, grid, listed(map::all_of(grid.size())), parallel);
  reach::BoundField bounds(grid, model.bound, std::move(air));
  for (const map::VoxelBox& piece : pieces(grid.size()))
    update_bounds(bounds, whole ? *whole : grid, low, grid.size(), vehicle_model, piece, listed(piece), parallel);
  reach::HoverMap hover(grid);
  for (const map::VoxelBox& piece : pieces(grid.size()))
    fill_hover(hover, reach, grid, distance, sums, bounds, listed(piece), constant_margin, parallel);
  SafeSpace safe(hover.safe_voxels());
  CentreResponse response(vehicle, reach.loop);
  return std::make_shared<const World>(World{std::move(grid), std::move(distance), std::move(sums), std::move(bounds),
                                             std::move(hover), std::move(safe), std::move(reach), std::move(response),
                                             constant_margin});
}

}  // namespace

std::shared_ptr<const World> build_world(map::OccupancyGrid grid, const Model& model, const Vehicle& vehicle,
                                         reach::Method method, std::optional<double> constant_margin,
                                         const Parallel& parallel) {
  return build(nullptr, Index3::Zero(), std::move(grid), model, vehicle, method, constant_margin, parallel);
}

std::shared_ptr<const World> build_part(const map::OccupancyGrid& grid, const map::VoxelBox& columns,
                                        const Model& model, const Vehicle& vehicle, const Parallel& parallel) {
  return build(&grid, columns.low, map::part_of(grid, columns), model, vehicle, reach::Method::tight, std::nullopt,
               parallel);
}

World with_clearance_by(World world, reach::Method method, std::optional<double> constant_margin,
                        const Parallel& parallel) {
  const Vehicle vehicle = world.reach.vehicle;
  world.reach = sets_of(vehicle, method);
  world.response = CentreResponse(vehicle, world.reach.loop);
  world.constant_margin = constant_margin;
  world.hover = reach::HoverMap(world.grid);
  for (const map::VoxelBox& piece : pieces(world.grid.size()))
    fill_hover(world.hover, world.reach, world.grid, world.distance, world.sums, world.bounds,
               voxels_for_centre(world.grid, world.distance, vehicle, piece), constant_margin, parallel);
  world.safe = SafeSpace(world.hover.safe_voxels());
  return world;
}

std::shared_ptr<const World> with_air(const World& old, const AirFactors& factors, const Model& model,
                                      const Parallel& parallel) {
  World world = old;
  if (!world.air.known()) {
    const map::VoxelBox all = map::all_of(world.grid.size());
    const auto voxels = voxels_for_centre(world.grid, world.distance, world.reach.vehicle, all);
    world.air.update(world.grid, with_vehicle(model, world.reach.vehicle), all, voxels, voxels, parallel);
  }
  if (world.air.factors == factors) return std::make_shared<const World>(std::move(world));
  world.air.factors = factors;
  world.bounds.revalue(
      [&](std::size_t n) -> std::optional<Variance> {
        const AirClass air = world.air.classes[n];
        if (factor_of(factors, air) == factor_of(old.air.factors, air)) return std::nullopt;
        return world.air.flown_at(n);
      },
      parallel);
  // Sets grow with the air: where hovering is not safe it is not in a rougher one.
  const auto listed =
      larger(factors, old.air.factors) == factors
          ? voxels_where(old.hover.safe_voxels())
          : voxels_for_centre(world.grid, world.distance, world.reach.vehicle, map::all_of(world.grid.size()));
  world.hover = reach::HoverMap(world.grid);
  fill_hover(world.hover, world.reach, world.grid, world.distance, world.sums, world.bounds, listed,
             world.constant_margin, parallel);
  world.safe = SafeSpace(world.hover.safe_voxels());
  return std::make_shared<const World>(std::move(world));
}

std::shared_ptr<const World> update_world(const World& old, map::OccupancyGrid grid, const map::VoxelBox& changed,
                                          const Model& model, const Parallel& parallel) {
  if (changed.empty()) return std::make_shared<const World>(old);
  const Vehicle& vehicle = old.reach.vehicle;
  const Model vehicle_model = with_vehicle(model, vehicle);
  map::DistanceField distance = old.distance;
  distance.update(grid, changed);
  map::OccupancySums sums = old.sums;
  sums.update(grid, changed.low, changed.high);
  const auto listed = [&](const map::VoxelBox& box) { return voxels_for_centre(grid, distance, vehicle, box); };

  map::VoxelBox columns = field::affected_columns(grid, vehicle_model, changed);
  const auto add_beside = [&](double metres) {
    const int by = static_cast<int>(std::ceil(metres / grid.resolution())) + 1;
    const map::VoxelBox beside = grown(changed, {by, by, grid.size().z()}, grid.size());
    columns.add(beside.low);
    columns.add(beside.high);
  };
  add_beside(vehicle.body.radius);  // a wide body's centre gets places, or loses them, beyond the field's range
  reach::BoundField bounds = old.bounds;
  const bool by_place = bounds.extension().by_place();
  if (by_place) {
    field::Extension air = bounds.extension();
    add_beside(air.level_range());
    fill_air(air, grid, listed(columns), parallel);
    bounds.extend(std::move(air));
  }
  const std::vector<std::size_t> inside = listed(columns);
  AirScale scale = old.air;
  if (scale.known()) {
    scale.update(grid, vehicle_model, columns, listed(map::all_of(grid.size())), inside, parallel);
    const field::DisturbanceField flown = scale.flown();
    bounds.update(columns, inside, [&](const auto& store) {
      for (const std::size_t n : inside) store(n, flown.at(grid.voxel(n)));
    });
  } else {
    update_bounds(bounds, grid, Index3::Zero(), grid.size(), vehicle_model, columns, inside, parallel);
  }

  // Pushes of anywhere widen the largest sets; an integrator may hold what blows anywhere.
  const bool whole = by_place || reach::has_integrator(vehicle);
  const map::VoxelBox hover_box = whole ? map::all_of(grid.size()) : reached_by_hover(old, bounds, columns, changed);
  reach::HoverMap hover = old.hover;
  hover.clear(hover_box);
  fill_hover(hover, old.reach, grid, distance, sums, bounds, listed(hover_box), old.constant_margin, parallel);
  SafeSpace safe = old.safe;
  safe.update(hover.safe_voxels(), hover_box);
  return std::make_shared<const World>(World{std::move(grid), std::move(distance), std::move(sums), std::move(bounds),
                                             std::move(hover), std::move(safe), old.reach, old.response,
                                             old.constant_margin, std::move(scale)});
}

}  // namespace backwash::plan

// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/world/world.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "core/field/field_update.hpp"

namespace backwash::plan {
namespace {

map::VoxelBox grown(const map::VoxelBox& box, const Index3& by, const Index3& size) {
  return {(box.low - by).cwiseMax(0), (box.high + by).cwiseMin(size - Index3::Ones())};
}

/// A box in pieces of about 300 × 300 columns: what is needed besides the world itself is that of one piece.
std::vector<map::VoxelBox> pieces(const map::VoxelBox& box) {
  const Index3 size = box.high - box.low + Index3::Ones();
  constexpr int kMost = 320;  // voxels
  const auto parts = [](int n) { return (n + kMost - 1) / kMost; };
  const int nx = parts(size.x()), ny = parts(size.y());
  std::vector<map::VoxelBox> result;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      result.push_back({box.low + Index3(size.x() * i / nx, size.y() * j / ny, 0),
                        box.low + Index3(size.x() * (i + 1) / nx - 1, size.y() * (j + 1) / ny - 1, size.z() - 1)});
  return result;
}

/// The voxels of a box where the vehicle's centre can be.
std::vector<std::size_t> listed(const World& world, const map::VoxelBox& box) {
  return voxels_for_centre(world.grid, world.distance, world.reach.vehicle, box);
}

/// The free voxels, linear, in rising order.
std::vector<std::size_t> voxels_where(const map::OccupancyGrid& free) {
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < free.cell_count(); ++n)
    if (free.at(n) == map::Cell::free) voxels.push_back(n);
  return voxels;
}

/// The first stage takes the map: what a change reaches in distances and box counts, they find themselves.
World on_map(World world, map::OccupancyGrid grid, const map::VoxelBox& changed) {
  world.distance.update(grid, changed);
  world.sums.update(grid, changed.low, changed.high);
  world.grid = std::move(grid);
  return world;
}

/// Whether a box is all of a grid.
bool is_all(const map::VoxelBox& box, const map::OccupancyGrid& grid) {
  const map::VoxelBox all = map::all_of(grid.size());
  return box.low == all.low && box.high == all.high;
}

/// Where Σ, or what an extension adds, can change, and where the vehicle's centre gets places or loses them.
map::VoxelBox columns_reached(const World& world, const map::VoxelBox& changed) {
  if (changed.empty() || is_all(changed, world.grid)) return changed;
  map::VoxelBox columns = field::affected_columns(world.grid, world.model, changed);
  const field::Extension& air = world.bounds.extension();
  // A wide body's centre gets places, or loses them, beyond the field's range.
  const double beside = std::max(world.reach.vehicle.body.radius, air.by_place() ? air.level_range() : 0);
  const int by = static_cast<int>(std::ceil(beside / world.grid.resolution())) + 1;
  const map::VoxelBox near = grown(changed, {by, by, world.grid.size().z()}, world.grid.size());
  columns.add(near.low);
  columns.add(near.high);
  return columns;
}

/// Σ at some voxels of whole columns, from what can reach them alone in the map that the world is a part of.
reach::FillVariance variance_in(const World& world, const map::OccupancyGrid& whole, const map::VoxelBox& columns,
                                std::span<const std::size_t> voxels, const Parallel& parallel) {
  return [&, columns, voxels](const auto& store) {
    const Index3 low = ((world.grid.origin() - whole.origin()) / whole.resolution()).array().round().cast<int>();
    std::vector<std::size_t> of_whole;
    if (&whole != &world.grid)
      for (const std::size_t n : voxels) of_whole.push_back(whole.linear(world.grid.voxel(n) + low));
    const field::Extension& air = world.bounds.extension();
    const auto take = [&](const Index3& of, const Variance& s) {
      const Index3 v = of - low;
      const auto factor = air.by_place() ? static_cast<float>(std::exp(air.at(v).ln_variance)) : 1.f;
      const auto single = [factor](double of_s) { return factor * static_cast<float>(of_s); };
      store(world.grid.linear(v), Variance{single(s.xx), single(s.xy), 0, single(s.yy), 0, single(s.zz)});
    };
    const std::span<const std::size_t> at = &whole == &world.grid ? voxels : std::span<const std::size_t>(of_whole);
    field::evaluate_columns(whole, world.model, {low + columns.low, low + columns.high}, at, take, parallel);
  };
}

/// The second stage takes the map and a model, in the columns that the change reaches.
World with_bounds(World world, const map::VoxelBox& columns, const map::OccupancyGrid* around,
                  const Parallel& parallel) {
  const map::OccupancyGrid& whole = around ? *around : world.grid;
  if (world.bounds.extension().by_place()) world.bounds.extend(world.grid, listed(world, columns), parallel);
  if (world.air.known()) {
    const auto inside = listed(world, columns), all = listed(world, map::all_of(world.grid.size()));
    world.air.update(world.grid, world.model, columns, all, inside, parallel);
    world.bounds.update(columns, inside, [&](const auto& store) {
      for (const std::size_t n : inside) store(n, world.air.flown_at(n));
    });
    return world;
  }
  for (const map::VoxelBox& piece : pieces(columns)) {
    const auto inside = listed(world, piece);
    world.bounds.update(piece, inside, variance_in(world, whole, piece, inside, parallel), parallel);
  }
  return world;
}

/// Takes the factors of the air too, which reach the bounds of the classes whose factor is another.
World in_air(World world, const AirFactors& factors, const Parallel& parallel) {
  const map::VoxelBox all = map::all_of(world.grid.size());
  if (!world.air.known()) {
    const auto voxels = listed(world, all);
    world.air.update(world.grid, world.model, all, voxels, voxels, parallel);
  }
  const AirFactors before = std::exchange(world.air.factors, factors);
  if (before == factors) return world;
  world.bounds.revalue(
      [&](std::size_t n) -> std::optional<Variance> {
        const AirClass air = world.air.classes[n];
        if (factor_of(factors, air) == factor_of(before, air)) return std::nullopt;
        return world.air.flown_at(n);
      },
      parallel);
  return world;
}

/// The third stage takes a vehicle's loop, which reaches all places to hover.
World clear_by(World world, Clearance clearance) {
  world.reach = std::move(clearance.reach);
  world.constant_margin = clearance.margin;
  return world;
}

/// What a change is to be compared with.
struct Before {
  DisturbanceBound largest;
  AirFactors air;
};

/// Where hovering can become safe or unsafe: a set reads w̄ over itself, and obstacles up to 1 m (the cap of its
/// clearance) and the body around it. No set is wider than the largest bound of all makes it.
map::VoxelBox places_reached(const World& world, const Before& before, const map::VoxelBox& columns,
                             const Change& change) {
  const auto& grid = world.grid;
  const bool of_all = change.clearance || world.air.factors != before.air;
  if (columns.empty() && !of_all) return {};
  // Pushes of anywhere widen the largest sets; an integrator may hold what blows anywhere.
  if (of_all || world.bounds.extension().by_place() || reach::has_integrator(world.reach.vehicle))
    return map::all_of(grid.size());
  const double w = std::max(std::ranges::max(world.bounds.largest().w), std::ranges::max(before.largest.w));
  const double h = std::max(w * std::max(world.reach.horizontal.h_inf, world.reach.vertical.h_inf),
                            world.constant_margin.value_or(0.0));
  const auto& vehicle = world.reach.vehicle;
  const auto voxels = [&](double metres) {  // of an infinite bound, or one that is no number: all
    const double most = grid.size().maxCoeff(), count = std::ceil(metres / grid.resolution());
    return Index3::Constant(static_cast<int>(count < most ? count : most) + 2).eval();
  };
  map::VoxelBox box = grown(columns, voxels(h), grid.size());
  const map::VoxelBox near =
      grown(change.voxels, voxels(1 + vehicle.body.radius + vehicle.estimation.position + 2 * h), grid.size());
  box.add(near.low);
  box.add(near.high);
  return box;
}

/// The last stage takes all of them. `safe_alone`: no place in the box can become safe.
World with_hover(World world, const map::VoxelBox& box, bool safe_alone, const Parallel& parallel) {
  const auto find = [&](std::span<const std::size_t> voxels) {
    parallel(voxels.size(), [&](std::size_t begin, std::size_t end) {
      world.hover.fill(world.reach, world.grid, world.distance, world.sums, world.bounds,
                       voxels.subspan(begin, end - begin), world.constant_margin);
    });
  };
  const auto safe = safe_alone ? voxels_where(world.hover.safe_voxels()) : std::vector<std::size_t>{};
  const bool anew = is_all(box, world.grid);
  if (anew)
    world.hover = reach::HoverMap(world.grid);
  else
    world.hover.clear(box);
  if (safe_alone)
    find(safe);
  else
    for (const map::VoxelBox& piece : pieces(box)) find(listed(world, piece));
  if (anew)
    world.safe = SafeSpace(world.hover.safe_voxels());
  else
    world.safe.update(world.hover.safe_voxels(), box);
  return world;
}

constexpr std::size_t kKeptBytes = sizeof(reach::BoundCodes) + 1;  // of a voxel: w̄, and whether hovering is safe

/// In place of all stages but the first, what they made before.
std::shared_ptr<const World> restored(World world, std::string_view kept, const Parallel& parallel) {
  const map::VoxelBox all = map::all_of(world.grid.size());
  const auto voxels = listed(world, all);
  if (kept.size() != voxels.size() * kKeptBytes) return nullptr;
  world.hover = reach::HoverMap(world.grid);
  std::vector<reach::BoundCodes> codes(voxels.size());
  for (std::size_t n = 0; n < voxels.size(); ++n) {
    std::memcpy(codes[n].data(), kept.data() + n * kKeptBytes, sizeof(reach::BoundCodes));
    if (kept[n * kKeptBytes + kKeptBytes - 1]) world.hover.set_safe(world.grid.voxel(voxels[n]));
  }
  if (world.bounds.extension().by_place()) world.bounds.extend(world.grid, voxels, parallel);
  world.bounds.restore(voxels, codes, parallel);
  world.safe = SafeSpace(world.hover.safe_voxels());
  return std::make_shared<const World>(std::move(world));
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

World unbuilt_world(map::OccupancyGrid grid, const Model& model, const Vehicle& vehicle, reach::Method method,
                    std::optional<double> constant_margin) {
  Model of_vehicle = with_vehicle(model, vehicle);
  map::DistanceField distance(grid);
  map::OccupancySums sums(grid);
  reach::BoundField bounds(grid, model.bound, field::Extension(grid, of_vehicle));
  const map::OccupancyGrid none(grid.origin(), grid.resolution(), Index3::Ones(), map::Cell::unknown);
  reach::HoverMap hover(none);  // made when the bounds are, which need room themselves
  SafeSpace safe(none);
  reach::Reachability reach = sets_of(vehicle, method);
  return {std::move(of_vehicle), std::move(grid), std::move(distance), std::move(sums), std::move(bounds),
          std::move(hover),      std::move(safe), std::move(reach),    constant_margin};
}

std::shared_ptr<const World> rebuilt(World world, Change change, const Parallel& parallel) {
  if (change.kept) return restored(std::move(world), *change.kept, parallel);
  const Before before{world.bounds.largest(), world.air.factors};
  if (change.grid) world = on_map(std::move(world), std::move(*change.grid), change.voxels);
  const map::VoxelBox columns = columns_reached(world, change.voxels);
  if (!columns.empty()) world = with_bounds(std::move(world), columns, change.around, parallel);
  if (change.air) world = in_air(std::move(world), *change.air, parallel);
  if (change.clearance) world = clear_by(std::move(world), std::move(*change.clearance));
  const map::VoxelBox places = places_reached(world, before, columns, change);
  // Sets grow with the air: where hovering is not safe it is not in a rougher one.
  const bool rougher =
      columns.empty() && !change.clearance && larger(world.air.factors, before.air) == world.air.factors;
  if (!places.empty()) world = with_hover(std::move(world), places, rougher, parallel);
  return std::make_shared<const World>(std::move(world));
}

std::shared_ptr<const World> build_world(map::OccupancyGrid grid, const Model& model, const Vehicle& vehicle,
                                         reach::Method method, std::optional<double> constant_margin,
                                         const Parallel& parallel) {
  const map::VoxelBox all = map::all_of(grid.size());
  return rebuilt(unbuilt_world(std::move(grid), model, vehicle, method, constant_margin), {.voxels = all}, parallel);
}

std::string kept_of(const World& world) {
  const auto voxels = listed(world, map::all_of(world.grid.size()));
  std::string kept(voxels.size() * kKeptBytes, '\0');
  char* to = kept.data();
  for (const std::size_t n : voxels) {
    const Index3 v = world.grid.voxel(n);
    std::memcpy(to, world.bounds.codes(v).data(), sizeof(reach::BoundCodes));
    to[kKeptBytes - 1] = static_cast<char>(world.hover.safe(v));
    to += kKeptBytes;
  }
  return kept;
}

}  // namespace backwash::plan

// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/world.hpp"

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

/// Σ at the listed voxels, that of `previous` where it holds still.
field::DisturbanceField store_field(const map::OccupancyGrid& grid, const Model& model,
                                    const std::vector<std::size_t>& voxels, const Parallel& parallel,
                                    const World* previous) {
  const auto fill = [&](field::DisturbanceField& field, std::span<const std::size_t> part) {
    const field::WholeField whole(grid, model, part);
    parallel(whole.block_count(), [&](std::size_t begin, std::size_t end) { field.fill(whole, begin, end); });
  };
  const bool same_frame = previous && previous->grid.origin() == grid.origin() &&
                          previous->grid.resolution() == grid.resolution() && previous->grid.size() == grid.size();
  if (!same_frame) {
    field::DisturbanceField field(grid);
    fill(field, voxels);
    return field;
  }
  field::DisturbanceField field = previous->field;
  if (const auto changed = field::changed_box(previous->grid, grid)) {
    const auto columns = field::affected_columns(grid, model, *changed);
    field.forget(columns);
    fill(field, field::voxels_within(grid, voxels, columns));
  }
  return field;
}

}  // namespace

void run_serial(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) { work(0, count); }

std::shared_ptr<const World> build_world(map::OccupancyGrid grid, const Model& model, const Vehicle& vehicle,
                                         reach::Method method, double constant_margin, const Parallel& parallel,
                                         const World* previous) {
  Model vehicle_model = model;
  vehicle_model.ground.r0 = vehicle.body.diagonal_radius;
  // The paper's sets exist for its second-order loop only.
  const reach::Loop loop = method == reach::Method::paper ? reach::Loop::continuous : reach::Loop::vehicle;
  reach::Reachability reach(vehicle, method, loop);
  map::DistanceField distance(grid);

  const std::vector<std::size_t> voxels = voxels_for_centre(grid, distance, vehicle);
  field::DisturbanceField field = store_field(grid, vehicle_model, voxels, parallel, previous);

  reach::BoundField bounds(grid, field, model.bound);
  reach::HoverMap hover(grid);
  parallel(voxels.size(), [&](std::size_t begin, std::size_t end) {
    hover.fill(reach, grid, distance, bounds, std::span(voxels).subspan(begin, end - begin), constant_margin);
  });
  return std::make_shared<const World>(World{std::move(grid), std::move(distance), std::move(field), std::move(bounds),
                                             std::move(hover), std::move(reach), constant_margin});
}

}  // namespace backwash::plan

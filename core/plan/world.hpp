// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "core/field/disturbance_field.hpp"
#include "core/map/distance_field.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/map/occupancy_sums.hpp"
#include "core/map/voxel_box.hpp"
#include "core/plan/air_scale.hpp"
#include "core/plan/centre_response.hpp"
#include "core/plan/safe_space.hpp"
#include "core/reach/hover_set.hpp"
#include "core/reach/reach_tube.hpp"

namespace backwash::plan {

/// Runs `work(begin, end)` over disjoint ranges that cover [0, count), possibly from several threads, and returns when
/// all are done. core itself knows no threads: services pass their own.
using Parallel = std::function<void(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work)>;
void run_serial(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work);

/// Free voxels that hold a point at which the vehicle's centre can be: farther from obstacles than its body's radius,
/// less the half diagonal by which such a point may lie off the voxel's centre.
std::vector<std::size_t> voxels_for_centre(const map::OccupancyGrid& grid, const map::DistanceField& distance,
                                           const Vehicle& vehicle);

/// The model with the vehicle's r0, and the sets of its loop: the paper's exist for its second-order loop only.
Model with_vehicle(const Model& model, const Vehicle& vehicle);
reach::Reachability sets_of(const Vehicle& vehicle, reach::Method method);

/// Immutable picture of the surroundings for one vehicle: everything the planner and the checks read.
struct World {
  map::OccupancyGrid grid;
  map::DistanceField distance;
  map::OccupancySums sums;
  field::DisturbanceField field;
  reach::BoundField bounds;
  reach::HoverMap hover;
  SafeSpace safe;  ///< where hover.safe()
  reach::Reachability reach;
  CentreResponse response;                ///< of the predicted motion, for the optimiser
  std::optional<double> constant_margin;  ///< m: a ball in place of the reachable sets
  AirScale air{};                         ///< what bounds and hover map hold beside the model; `field` is the model's
};

/// Builds all of it. Σ is stored at every free voxel where the vehicle's centre can be (distance ≥ body radius less one
/// voxel diagonal). The model's r0 is taken from the vehicle.
std::shared_ptr<const World> build_world(map::OccupancyGrid grid, const Model& model, const Vehicle& vehicle,
                                         reach::Method method = reach::Method::tight,
                                         std::optional<double> constant_margin = std::nullopt,
                                         const Parallel& parallel = run_serial);

/// The same surroundings kept clear of in another way: Σ and its bounds, the expensive part, are taken over; loop and
/// hover map are made anew. Equal to building with that method and margin.
World with_clearance_by(World world, reach::Method method, std::optional<double> constant_margin,
                        const Parallel& parallel = run_serial);

/// The same surroundings in air that is rougher by these factors, each at least what it is in `old`: Σ is taken over,
/// its bounds and the hover map are made anew. Finds the classes where `old` has none. `old` must have been built with
/// this model. What update_world() makes of it keeps both.
std::shared_ptr<const World> with_air(const World& old, const AirFactors& factors, const Model& model,
                                      const Parallel& parallel = run_serial);

/// The same as build_world(grid, …), from a world of which only the voxels in `changed` differ: Σ and the hover map are
/// computed anew where a change can reach them and copied elsewhere. `old` must have been built with this model;
/// precondition: grids of the same place and size. Measured (bench_world, 1 m³ in a furnished room of 10 × 10 × 3 m at
/// 0.1 m, one thread): 0.35 of the rebuild's processor time, 89 against 257 ms on a machine shared by many.
std::shared_ptr<const World> update_world(const World& old, map::OccupancyGrid grid, const map::VoxelBox& changed,
                                          const Model& model, const Parallel& parallel = run_serial);

}  // namespace backwash::plan

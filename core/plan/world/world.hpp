// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/map/distance_field.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/map/occupancy_sums.hpp"
#include "core/map/voxel_box.hpp"
#include "core/plan/spline/centre_response.hpp"
#include "core/plan/world/air_scale.hpp"
#include "core/plan/world/safe_space.hpp"
#include "core/reach/hover_set.hpp"
#include "core/reach/reach_tube.hpp"
#include "core/types/parallel.hpp"

namespace backwash::plan {

/// Free voxels that hold a point at which the vehicle's centre can be: farther from obstacles than its body's radius,
/// less the half diagonal by which such a point may lie off the voxel's centre. Those of a box inside the grid, as
/// linear indices in rising order.
std::vector<std::size_t> voxels_for_centre(const map::OccupancyGrid& grid, const map::DistanceField& distance,
                                           const Vehicle& vehicle, const map::VoxelBox& box);

/// The model with the vehicle's r0, and the sets of its loop: the paper's exist for its second-order loop only.
Model with_vehicle(const Model& model, const Vehicle& vehicle);
reach::Reachability sets_of(const Vehicle& vehicle, reach::Method method);

/// Immutable picture of the surroundings for one vehicle: everything the planner and the checks read.
struct World {
  map::OccupancyGrid grid;
  map::DistanceField distance;
  map::OccupancySums sums;
  reach::BoundField bounds;
  reach::HoverMap hover;
  SafeSpace safe;  ///< where hover.safe()
  reach::Reachability reach;
  CentreResponse response;                ///< of the predicted motion, for the optimiser
  std::optional<double> constant_margin;  ///< m: a ball in place of the reachable sets
  AirScale air{};                         ///< what bounds and hover map hold beside the model
};

/// Builds all of it, Σ and its bounds by pieces of the map. Σ is computed at every free voxel where the vehicle's
/// centre can be (voxels_for_centre), and not kept. The model's r0 is taken from the vehicle.
std::shared_ptr<const World> build_world(map::OccupancyGrid grid, const Model& model, const Vehicle& vehicle,
                                         reach::Method method = reach::Method::tight,
                                         std::optional<double> constant_margin = std::nullopt,
                                         const Parallel& parallel = run_serial);

/// What is dear in a world, as bytes to keep between runs: w̄ where the vehicle's centre can be, and where hovering is
/// safe there. 11 bytes a voxel, of this machine's byte order. Precondition: a world of build_world().
std::string kept_of(const World& world);
/// The world that build_world() makes of these arguments, from what kept_of() gave for the same ones. Null where it has
/// another length than they want; bytes of another world or damaged ones are not noticed: keep a hash beside them.
std::shared_ptr<const World> restored_world(map::OccupancyGrid grid, const Model& model, const Vehicle& vehicle,
                                            reach::Method method, std::optional<double> constant_margin,
                                            std::string_view kept, const Parallel& parallel = run_serial);

/// The world of a part of a map, to fly in until the whole one is made: the part's box of whole columns is a grid of
/// its own, outside of which nothing is known, with the bounds that the whole map gives there. Where hovering is safe
/// in it, it is in the whole one. Precondition: a model without an extension; `columns` within the grid, from floor to
/// top.
std::shared_ptr<const World> build_part(const map::OccupancyGrid& grid, const map::VoxelBox& columns,
                                        const Model& model, const Vehicle& vehicle,
                                        const Parallel& parallel = run_serial);

/// The same surroundings kept clear of in another way: the bounds, the expensive part, are taken over; loop and
/// hover map are made anew. Equal to building with that method and margin.
World with_clearance_by(World world, reach::Method method, std::optional<double> constant_margin,
                        const Parallel& parallel = run_serial);

/// The same surroundings in air that is rougher by these factors: bounds and hover map are made anew. Cheaper where no
/// factor is below that of `old`. Σ and the classes are found where `old` has none, and kept from then on. `old` must
/// have been built with this model. What update_world() makes of it keeps both.
std::shared_ptr<const World> with_air(const World& old, const AirFactors& factors, const Model& model,
                                      const Parallel& parallel = run_serial);

/// The same as build_world(grid, …), from a world of which only the voxels in `changed` differ: Σ and the hover map are
/// computed anew where a change can reach them, and the rest is shared with `old` or copied. `old` must have been built
/// with this model; precondition: grids of the same place and size. Measured: core/plan/README.md, "A map that
/// changes".
std::shared_ptr<const World> update_world(const World& old, map::OccupancyGrid grid, const map::VoxelBox& changed,
                                          const Model& model, const Parallel& parallel = run_serial);

}  // namespace backwash::plan

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

/// Immutable picture of the surroundings for one vehicle: everything the planner and the checks read. It is made in
/// stages, each of what stands before it: map (grid, distance, sums), air (bounds, air), sets (reach,
/// constant_margin), places to hover (hover, safe). rebuilt() makes each anew where a change reaches it.
struct World {
  Model model;  ///< with the vehicle's r0
  map::OccupancyGrid grid;
  map::DistanceField distance;
  map::OccupancySums sums;
  reach::BoundField bounds;
  reach::HoverMap hover;
  SafeSpace safe;  ///< where hover.safe()
  reach::Reachability reach;
  std::optional<double> constant_margin;  ///< m: a ball in place of the reachable sets
  AirScale air{};                         ///< what bounds and hover map hold beside the model
};

/// What a vehicle keeps clear of obstacles by.
struct Clearance {
  reach::Reachability reach;       ///< of a vehicle with the body and estimation that the world was made for
  std::optional<double> margin{};  ///< m: a ball in place of the reachable sets
};

/// What a world is made anew for. What is not named is as it was.
struct Change {
  std::optional<map::OccupancyGrid> grid{};  ///< the map, of the same place and size
  map::VoxelBox voxels{};  ///< that alone differ in it, or all of a world in which nothing was found yet
  /// The map that the grid is a part of: its bounds are those that the whole map gives there. Null: outside of the grid
  /// nothing is known. Without an extension.
  const map::OccupancyGrid* around = nullptr;
  /// How much rougher than modelled the air is. Σ and the classes are found where the world has none, and kept from
  /// then on. Cheaper where no factor falls. Without an extension.
  std::optional<AirFactors> air{};
  std::optional<Clearance> clearance{};
  std::optional<std::string_view> kept{};  ///< what kept_of() gave for the same world, in place of all else
};

/// The surroundings with nothing found in them yet: no bound, and nowhere to hover.
World unbuilt_world(map::OccupancyGrid grid, const Model& model, const Vehicle& vehicle,
                    reach::Method method = reach::Method::tight, std::optional<double> constant_margin = std::nullopt);

/// The world after a change: bit for bit the one built anew, made anew where the change can reach it and shared with
/// `world` elsewhere. Σ is computed at free voxels where the vehicle's centre can be (voxels_for_centre), by pieces of
/// the map. Null: `kept` has another length than the world wants; bytes of another world or damaged ones are not
/// noticed, keep a hash beside them. Measured: core/plan/README.md, "A map that changes".
std::shared_ptr<const World> rebuilt(World world, Change change, const Parallel& parallel = run_serial);

/// That of an unbuilt_world() in which everything is found.
std::shared_ptr<const World> build_world(map::OccupancyGrid grid, const Model& model, const Vehicle& vehicle,
                                         reach::Method method = reach::Method::tight,
                                         std::optional<double> constant_margin = std::nullopt,
                                         const Parallel& parallel = run_serial);

/// What is dear in a world, as bytes to keep between runs: w̄ where the vehicle's centre can be, and where hovering is
/// safe there. 11 bytes a voxel, of this machine's byte order.
std::string kept_of(const World& world);

}  // namespace backwash::plan

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "core/plan/world/world.hpp"

namespace backwash::services {

/// What a world is made of, and the names by which model and vehicle were given: "builtin:NAME" or a file's path.
struct WorldInput {
  map::OccupancyGrid grid;
  const Model& model;
  const std::string& model_path;
  const Vehicle& vehicle;
  const std::string& vehicle_path;
  reach::Method method = reach::Method::tight;
  std::optional<double> margin = std::nullopt;  ///< m, in place of the sets
  const map::OccupancyGrid* around = nullptr;   ///< as in plan::Change
};

/// Worlds that were made before. One that takes longer than half a second is kept in the user's cache, and an equal one
/// is taken from there: equal in program, processor, map, model file, vehicle file, method and margin, and whole by its
/// hash. The folder: $BACKWASH_CACHE (empty: none), $XDG_CACHE_HOME/backwash or ~/.cache/backwash; it holds a gibibyte
/// at most, and the ones unused for longest go. A folder that others
/// can write is not used. What cannot be read or written there is no error.
class CachedWorld {
 public:
  explicit CachedWorld(WorldInput input);
  const WorldInput& input() const noexcept { return input_; }
  /// The world if an equal one is kept; null otherwise.
  std::shared_ptr<const plan::World> kept() const;
  /// plan::build_world, shown as progress, and kept from then on.
  std::shared_ptr<const plan::World> made() const;

 private:
  WorldInput input_;
  std::string folder_, key_;  // empty where nothing can be kept
};

/// The one that is kept, or made.
std::shared_ptr<const plan::World> world_of(WorldInput input);

}  // namespace backwash::services

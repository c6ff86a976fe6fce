// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/field/disturbance_field.hpp"
#include "core/plan/world/world.hpp"

namespace backwash::test {

/// Σ where a world has bounds of it, in single precision, from the whole map at once.
inline field::DisturbanceField stored_field(const plan::World& world, const Model& model) {
  const auto voxels =
      plan::voxels_for_centre(world.grid, world.distance, world.reach.vehicle, map::all_of(world.grid.size()));
  field::DisturbanceField stored(world.grid, voxels);
  const field::WholeField whole(world.grid, plan::with_vehicle(model, world.reach.vehicle), voxels);
  stored.fill(whole, 0, whole.block_count());
  return stored;
}

}  // namespace backwash::test

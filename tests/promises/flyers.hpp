// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "tests/promises/draw.hpp"

namespace backwash::promises {

/// A vehicle whose sets are small enough to fly indoors: a draw_vehicle() among many.
DrawnVehicle draw_flyer(Random& random, bool integrator);

struct FlyersWorld {
  DrawnVehicle vehicle;
  std::shared_ptr<const plan::World> world;
};
/// A map with places where such a vehicle may hover, in air as drawn, and often through a mapper's window.
FlyersWorld draw_flyers_world(Random& random, const Index3& least, const Index3& most);

/// The voxels where hovering is safe, linear.
std::vector<std::size_t> safe_places(const plan::World& world);
/// Somewhere in one of them.
Vec3 draw_place(Random& random, const plan::World& world, const std::vector<std::size_t>& places);

}  // namespace backwash::promises

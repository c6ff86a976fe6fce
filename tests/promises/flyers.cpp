// SPDX-License-Identifier: BSD-3-Clause
#include "tests/promises/flyers.hpp"

namespace backwash::promises {

DrawnVehicle draw_flyer(Random& random, bool integrator) {
  for (;;) {
    const DrawnVehicle drawn = draw_vehicle(random, integrator, false);
    const auto& v = drawn.vehicle;
    const auto indoors = [&](double kp, double kd) { return kp > 1.5 && kd > 1.5 && kp < 2 * kd * kd; };
    if (indoors(v.controller.kp.horizontal, v.controller.kd.horizontal) &&
        indoors(v.controller.kp.vertical, v.controller.kd.vertical) && v.controller.feedback_delay < 0.1 &&
        v.controller.attitude_lag < 0.2 && v.initial_error.position < 0.05 && v.initial_error.velocity < 0.1 &&
        v.limits.a_max < 5)
      return drawn;
  }
}

FlyersWorld draw_flyers_world(Random& random, const Index3& least, const Index3& most) {
  for (;;) {
    const bool window = random.chance(0.3);
    DrawnModel air = draw_model(random, true);
    air.model.unknown_floor = window;
    try {
      const DrawnVehicle drawn = draw_flyer(random, random.chance(0.2));
      auto world = plan::build_world(draw_map(random, least, most, window), air.model, drawn.vehicle);
      if (air.factors != kModelledAir) world = plan::rebuilt(*world, {.air = air.factors});
      if (safe_places(*world).size() > world->grid.cell_count() / 20) return {drawn, world};
    } catch (const std::invalid_argument&) {  // a loop that settles too late
    }
  }
}

std::vector<std::size_t> safe_places(const plan::World& world) {
  std::vector<std::size_t> places;
  for (std::size_t n = 0; n < world.grid.cell_count(); ++n)
    if (world.hover.safe(world.grid.voxel(n))) places.push_back(n);
  return places;
}

Vec3 draw_place(Random& random, const plan::World& world, const std::vector<std::size_t>& places) {
  const std::size_t n = places[static_cast<std::size_t>(random.whole(0, static_cast<int>(places.size()) - 1))];
  const double half = world.grid.resolution() / 2;
  return world.grid.center(world.grid.voxel(n)) + random.within(Vec3::Constant(-half), Vec3::Constant(half));
}

}  // namespace backwash::promises

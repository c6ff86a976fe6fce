// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {

/// As the daemon takes it from the files that ship.
inline adapt::InFlightConstants learning(double calmest = 1) {
  const Model model;
  adapt::InFlightConstants air;
  air.calmest = calmest;
  air.controller = vehicle_5in().controller;
  air.gusts.tau_low_s = air.gusts.tau_high_s = model.bound.tau_w;
  air.gusts.mean_horizontal = model.bound.mean_horizontal;
  air.gusts.mean_vertical = model.bound.mean_vertical;
  return air;
}

/// A rig that learns of the bench's air, `strength` times as strong in variance.
struct LearningRig : Lockstep {
  explicit LearningRig(double strength, std::uint64_t seed = 1,
                       const std::optional<adapt::InFlightConstants>& learns = learning(),
                       std::shared_ptr<const plan::World> world = known_air(),
                       const Vec3& ground_W = {-2, 0, vehicle_5in().body.radius})
      : Lockstep({0.7, Vec3(5, -3, 0.2)}, Medium::udp, std::move(world)) {
    autopilot =
        std::make_unique<HandledAutopilot>(world_->grid, vehicle_5in(), ground_W, local_frame, seed, 1, strength);
    air = learns;
    restart();
  }
  /// The corridor with the classes of its air.
  static std::shared_ptr<const plan::World> known_air() {
    static const auto world = plan::rebuilt(*corridor(), {.air = kModelledAir});
    return world;
  }
  double largest_factor() const { return view().air ? *std::ranges::max_element(view().air->factors) : 1; }
};

}  // namespace backwash::daemon::test

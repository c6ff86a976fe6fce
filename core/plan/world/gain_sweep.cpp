// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/world/gain_sweep.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "core/reach/hover_set.hpp"

namespace backwash::plan {

GainStep with_gains(const World& world, const Vec3& start_W, const Vec3& goal_W, double factor,
                    const Parallel& parallel) {
  Vehicle vehicle = world.reach.vehicle;
  auto& kp = vehicle.controller.kp;
  auto& kd = vehicle.controller.kd;
  kp = {factor * factor * kp.horizontal, factor * factor * kp.vertical};
  kd = {factor * kd.horizontal, factor * kd.vertical};
  GainStep step{factor, false, kp, kd, {}, {}};
  Change change;
  try {
    change.clearance =
        Clearance{reach::Reachability(vehicle, world.reach.method, world.reach.loop), world.constant_margin};
  } catch (const std::invalid_argument&) {
    return step;
  }
  step.stable = true;
  const auto faster = rebuilt(world, std::move(change), parallel);
  step.way = widest_way(*faster, start_W, goal_W);
  if (step.way)
    step.set = reach::hover_set(faster->reach, faster->grid, faster->distance, faster->bounds, step.way->place_W,
                                world.constant_margin);
  return step;
}

GainSweep sweep_gains(const World& world, const Vec3& start_W, const Vec3& goal_W, const std::vector<double>& factors,
                      const Parallel& parallel) {
  constexpr double kPrecision = 1.01;
  GainSweep sweep;
  for (const double factor : factors) {
    sweep.steps.push_back(with_gains(world, start_W, goal_W, factor, parallel));
    if (!sweep.smallest && sweep.steps.back().passable()) sweep.smallest = sweep.steps.back();
  }
  if (!sweep.smallest || sweep.smallest->factor == factors.front()) return sweep;
  double too_slow = factors.front();
  for (const double factor : factors)
    if (factor < sweep.smallest->factor) too_slow = factor;
  while (sweep.smallest->factor > kPrecision * too_slow) {
    const double between = std::sqrt(too_slow * sweep.smallest->factor);
    GainStep step = with_gains(world, start_W, goal_W, between, parallel);
    if (step.passable())
      sweep.smallest = std::move(step);
    else
      too_slow = between;
  }
  return sweep;
}

}  // namespace backwash::plan

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "tests/promises/air.hpp"
#include "tests/promises/draw.hpp"

namespace backwash::promises {

/// A vehicle's axes, its air, and what is drawn through it.
struct Drawn {
  DrawnVehicle vehicle;
  std::optional<Air> air;
  std::optional<reach::Reachability> sampled;  // in place of the world's
  int longest;                                 // tube, in periods
  std::array<Plant, 2> plant, charged;         // level, vertical; `charged`: with the integrator
  std::vector<Answer> answer, charged_answer;
  const reach::Reachability& reach() const { return sampled ? *sampled : air->world->reach; }
};

/// One tube.
struct Case {
  const Drawn* drawn;
  State start;
  Setpoint previous;
  std::vector<Setpoint> commands;
  reach::ReachTube tube;
  bool through = true;       // the air, not bounds of its own
  std::vector<Vec3> centre;  // by our own motion, at each step
  int steps() const { return static_cast<int>(commands.size()) * drawn->vehicle.per_period; }
  /// The bound of the period in which a step lies; after the last one that of the last.
  double bound(int step, Direction d) const {
    return tube[static_cast<std::size_t>(step / drawn->vehicle.per_period)].w_bar.w[d];
  }
};

/// A vehicle that every part of the program takes, in air of its own. Refused loops (they settle too late) are drawn
/// again.
Drawn draw_vehicle_and_air(Random& random);
/// Commands of held accelerations within the limits, and the tube along them, through the air or by bounds of its own.
Case draw_case(const Drawn& drawn, Random& random);

/// A disturbance of one direction: its sign at each step, and the first error.
struct Attack {
  Direction d;
  double p0 = 0, v0 = 0;
  std::vector<double> sign;
  int to = -1;  // where it is to reach the half width
};

using Attacks = std::array<Attack, Motions::kLanes>;

/// What pushes farthest at step `to`; by random signs after it.
Attack worst(const Case& c, const Answer& answer, Direction d, int to, Random& random);
/// Turns about at random.
Attack switching(const Case& c, Direction d, Random& random);

/// Flies eight motions beside one another under push(step, direction) times their signs; each(step, positions along
/// their directions) at the start of every step and at the end.
void fly(const Case& c, const Plant& plant, const Attacks& attacks, const std::function<double(int, Direction)>& push,
         const std::function<void(int, const Motions::Lanes&)>& each);

}  // namespace backwash::promises

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "core/plan/planner.hpp"

namespace backwash::plan {

/// Why the vehicle may not be left at rest at p, one line; nothing where it may: the place must be free, its hover set
/// bounded, and its clearance more than `least_clearance`, m.
std::optional<std::string> why_no_rest(const World& world, const Vec3& p_W, double least_clearance);
/// The one question that every place of rest is asked: a start, a goal, the top of a take-off, where a replanned way
/// ends. What comes to rest by a tube asks it by tube_to_rest() (rest.hpp).
inline bool may_rest_at(const World& world, const Vec3& p_W, double least_clearance) {
  return !why_no_rest(world, p_W, least_clearance);
}

/// Why the first set, of the vehicle where it is now, is not clear: whatever is commanded changes nothing there.
std::optional<std::string> why_blocked_now(const World& world, const PlanStart& start, double least_clearance);

/// The refusal that plan() would end with because hovering at the start's command or at the goal is not safe, said
/// before a world is built: Σ is computed about both ends alone, from the part of the map that it can depend on.
/// Nothing where the ends are clear, and where only a world can say (a model with an extension).
std::optional<Plan> refused_at_once(const map::OccupancyGrid& grid, const Model& model, const Vehicle& vehicle,
                                    reach::Method method, std::optional<double> constant_margin, const PlanStart& start,
                                    const Vec3& goal_W, const PlanOptions& options);

}  // namespace backwash::plan

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>

#include "core/plan/planner.hpp"

namespace backwash::plan {

/// Makes the world of a part of a map: a grid at its place in which what is not to be built is unknown. `around`: the
/// whole map, for Change::around; null where the part is all of it.
using MakeWorld =
    std::function<std::shared_ptr<const World>(map::OccupancyGrid part, const map::OccupancyGrid* around)>;

/// plan() of a vehicle on a map whose world is made where the plan is looked for. The search's way over all places that
/// are farther from obstacles than the body leads there; made is what a vehicle reaches within 10 voxels of it, all
/// else is unknown, and so an obstacle, and what is verified holds in the whole map. Where no plan is found there, or
/// one more than a tenth longer than the way over what is safe or not made yet, more is made: four times as far, about
/// that way, too; the whole world where that is a third of it. What ends without a plan has made the whole world, or no
/// way is left. `model`: without the
/// vehicle's r0; with an extension by place, or a loop with an integrator, all is made at once.
Plan plan_along(const map::OccupancyGrid& map, const Model& model, const Vehicle& vehicle, const MakeWorld& make,
                const PlanStart& start, const Vec3& goal_W, const PlanOptions& options);

}  // namespace backwash::plan

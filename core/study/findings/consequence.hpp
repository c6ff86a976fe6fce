// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/plan/planner.hpp"
#include "core/plan/world/world.hpp"
#include "core/study/findings/study.hpp"

namespace backwash::study {

/// What a model makes of the places that were flown, and of one plan between two of them.
struct FlightOutcome {
  /// Of the hover sets at flown places, m.
  struct HoverSizes {
    double extent_median, extent_95;  ///< largest half width
    double shift_median, shift_95;    ///< of the centre from its set-point
  };
  double inside = 0;                       ///< share of samples of a − a_sim within push ± w̄, all axes together
  std::optional<HoverSizes> hover;         ///< none where no set is bounded
  std::optional<double> safe;              ///< share of the places where hovering is safe; none without a map
  std::optional<plan::PlanStatus> plan;    ///< none was tried without two safe places apart and a map
  std::optional<plan::PlanMetrics> flown;  ///< of the plan, if ok
};

struct Consequence {
  FlightOutcome before, after;
  std::optional<FlightOutcome> corrected = {};  ///< model as before, vehicle file as the remedies say; `inside` is 0
  std::size_t places = 0;
  Vec3 start_W = Vec3::Zero(), goal_W = Vec3::Zero();  ///< of the plan
};

/// Before and after the accepted causes joined the model. `inside` after: with parameters fitted without the window's
/// flight. Hover sets: at up to 60 of the flown places, of worlds with the maps, or without any from Σ_0 alone. The
/// plan: between the two places of one map farthest apart that are safe in the world before. `grids`: of each flight,
/// or empty. `corrected`: the vehicle file as its remedies say, or nothing. Two or three worlds are built of each
/// map: seconds of a large one.
Consequence consequence(const StudyResult& result, const Observations& seen, const Model& model, const Vehicle& vehicle,
                        std::span<const map::OccupancyGrid* const> grids,
                        const std::optional<Vehicle>& corrected = std::nullopt, const Parallel& parallel = run_serial);

}  // namespace backwash::study

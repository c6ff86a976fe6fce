// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "core/plan/search/kinodynamic_astar.hpp"
#include "core/plan/spline/bspline.hpp"
#include "core/plan/spline/yaw.hpp"
#include "core/plan/world/world.hpp"
#include "core/reach/risk.hpp"

namespace backwash::plan {

/// infeasible: start and goal are joined by hover-safe space, but no verified trajectory within the limits was found.
/// deadline: time or the cap of states ran out before an answer.
enum class PlanStatus { ok, no_path, infeasible, start_blocked, goal_blocked, deadline };
/// "ok", "no_path", … as in the JSON of `plan` (docs/interfaces.md).
const char* to_string(PlanStatus status) noexcept;

/// Where the predicted motion starts: the estimated state, and the command active now, which the plan continues.
struct PlanStart {
  State estimated;
  Setpoint command;
};

struct PlanOptions {
  double v_max;                     ///< m/s per axis; a start that is faster may not speed up
  double a_max;                     ///< m/s² per axis
  double deadline_s = 10.0;         ///< whole plan, monotonic clock; what is found when it passes is still verified
  std::size_t max_nodes = 400'000;  ///< states that an attempt of the search may keep
  YawLimits yaw{};                  ///< the heading follows the path; rate 0: it is held
  bool norm_cost = false;           ///< the cost takes ‖h‖₂ for the set, as the paper does: for comparison only
  double least_clearance_m = 0;     ///< that the verified tube, and hovering at start and goal, must pass, m
};

struct PlanMetrics {
  double length_m = 0, time_s = 0;
  double jerk2 = 0;            ///< ∫‖p⃛‖² dt of the command trajectory, (m/s³)² s
  double min_clearance_m = 0;  ///< over the verified swept tube (docs/model.md section 4)
  double search_ms = 0, tubes_ms = 0, optimise_ms = 0, verify_ms = 0;  ///< together the whole, ends and metrics apart
  std::size_t expanded = 0, evaluations = 0;                           ///< states of the search, steps of the optimiser
  reach::Risk risk{};                                                  ///< where one was stated
};

/// The model by which a stated risk is kept in place of the worst case (docs/model.md 5.3-5): what is kept clear in its
/// world is a first guess, and what flies is asked keeps(). Errors: of reach::kappa_of(); throws
/// std::invalid_argument for a loop with an integrator, an extended model, and a κ below what a minute at rest asks
/// for.
Model model_for(Model model, const Vehicle& vehicle, double risk);

struct Plan {
  PlanStatus status = PlanStatus::no_path;
  std::string message;  ///< one line: why not, and where; empty when ok
  BSpline trajectory;
  std::vector<Setpoint> commands;  ///< every 20 ms, then the goal is held until the loop has settled
  reach::ReachTube tube;           ///< verified: one entry more than commands
  PlanMetrics metrics;
};

/// Start of a plan: the state estimated now and the command active now (for continuity).
/// Kinodynamic search → B-spline fit → optimisation → verification of the whole swept tube (docs/model.md section 5b).
/// The first that is verified is returned. What fails is optimised again about its own sets with a larger margin, then
/// slowed, then refused; never returned as ok.
Plan plan(const World& world, const PlanStart& start, const Vec3& goal_W, const PlanOptions& options);

/// Where a tube comes nearest to obstacles.
struct Approach {
  double clearance;  ///< m, capped at 2 m; negative: not clear
  State center;      ///< predicted motion there
  double t;          ///< s since the tube's start
};
/// The smallest clearance of a tube swept through the world: prism query over each interval with the centre's motion,
/// less body.radius and estimation.position; with a constant margin, ball of that radius. Precondition: not empty.
Approach nearest_approach(const World& world, const reach::ReachTube& tube);
/// What a tube risks from entry `from` on, and a minute of resting at its end; none where the model states no risk.
/// `apart`: that the frames are apart, m.
reach::Risk risk_of(const World& world, const reach::ReachTube& tube, std::size_t from = 0, double apart = 0);
/// Whether that is no more than what the world's model states.
bool keeps(const World& world, const reach::Risk& risk) noexcept;
/// Clearance of a tube from entry `from` on, m: none, 0, is left of it where its risk does not keep what is stated.
double tube_clearance(const World& world, const reach::ReachTube& tube, std::size_t from = 0, double apart = 0);

/// Lowest height z_safe (m, W) of the column through p at which the vehicle may rest with more than `least_clearance`
/// (m; may_rest_at()), and the floor below it; nothing if there is none.
/// Take-off and landing move vertically in this column (docs/model.md section 4).
struct TakeoffColumn {
  double z_floor;  ///< top of the first obstacle below, m
  double z_safe;   ///< m
};
std::optional<TakeoffColumn> takeoff_column(const World& world, const Vec3& p_W, double least_clearance);

/// Clearance that a take-off tube must have (docs/model.md section 4): beside it only while its centre is below z_safe
/// (m, W), all around from there on and where it comes to rest, m; from entry `from` on. Precondition: not empty.
double takeoff_clearance(const World& world, const reach::ReachTube& tube, double z_safe, std::size_t from = 0,
                         double apart = 0);

/// Smallest lateral clearance of a vertical tube: obstacles beside it, not the floor below (docs/model.md section 4),
/// m.
double lateral_clearance(const World& world, const reach::ReachTube& tube);
/// The same of a map without its world.
double lateral_clearance(const map::OccupancyGrid& grid, const Vehicle& vehicle, std::optional<double> margin,
                         const reach::ReachTube& tube);

}  // namespace backwash::plan

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/sim/flight.hpp"

// The paper's Table I: the same start–goal pairs in the same air, planned with different clearances, flown in closed
// loop against the airflow truth. README.md says what is measured and what came out.
namespace backwash::sim {

/// A way of keeping clear: the reachable sets, or a constant margin in their place.
struct CompareMethod {
  std::string name;
  reach::Method sets = reach::Method::tight;
  std::optional<double> margin = {};  ///< m: a ball in place of the sets
  bool norm_cost = false;             ///< plan::PlanOptions::norm_cost
};
/// The proposed method ("tight"), the same with ‖h‖₂ in the cost ("tight-norm"), with the paper's ellipsoids ("paper"),
/// and margins of 0.1, 0.2, 0.3 and 0.4 m.
std::vector<CompareMethod> compare_methods();

/// Two hover points and the air between them, the same for every method.
struct RoutePair {
  Vec3 start_W, goal_W;  ///< m, centres of voxels
  std::uint64_t seed;    ///< of airflow and VIO error
};
/// Draws pairs from the free voxels that any vehicle could use: farther from obstacles than body.radius +
/// estimation.position, 0.5 to 2 m above what lies under them, joined to each other through free voxels with that
/// distance (the largest such region). Start and goal are at least 3 m apart. Deterministic for a seed on every
/// platform; nothing where no two such points were found. O(cells).
std::optional<std::vector<RoutePair>> draw_pairs(const map::OccupancyGrid& grid, const map::DistanceField& distance,
                                                 const Vehicle& vehicle, std::size_t count, std::uint64_t seed);

/// What planning gave and, where it gave a trajectory, the flight along it.
struct Route {
  plan::Plan plan;
  FlightPiece piece;  ///< no samples where the plan's status is not ok
};
/// Hovers one second at the start, plans from the state estimated then, follows and holds one second at the goal.
/// `vehicle` is what flies and what touches; the world's own vehicle is what the planner believes. No wall clock:
/// planning ends by its caps, so the route is deterministic for the pair.
Route fly_route(const plan::World& world, const Vehicle& vehicle, const RoutePair& pair, bool norm_cost = false);

/// A route in figures.
struct RouteOutcome {
  plan::PlanStatus status = plan::PlanStatus::no_path;
  plan::PlanMetrics planned;  ///< of the commands
  double planning_ms = 0;     ///< wall clock: search, optimisation, verification
  double flown_m = 0;         ///< way of the true position
  double flown_jerk2 = 0;  ///< ∫‖d/dt (thrust/mass)‖² dt at 50 Hz: commands and the answer to gusts, (m/s³)² s
  double energy_J = 0;     ///< ∫ T^(3/2)/√(2ρA) dt: induced power of four ideal rotors in still air
  double clearance_m = 0;  ///< smallest distance of the true position to an obstacle, less the body's radius
  std::size_t samples = 0;   ///< at 50 Hz
  std::size_t contacts = 0;  ///< samples nearer to an obstacle than the body's radius
  std::size_t outside = 0;   ///< samples outside the set they were planned with; margins: a ball of that radius
  Vec3 largest_ratio = Vec3::Zero();  ///< largest |e|/h per axis, of sets only
};
RouteOutcome measure(const Route& route, const plan::World& world, const Vehicle& vehicle);

/// All methods over the same pairs of one scene.
struct SceneComparison {
  std::string scene, vehicle;
  std::vector<RoutePair> pairs;
  std::vector<std::vector<RouteOutcome>> outcomes;  ///< [method][pair]
};
/// Flies every pair with every method. `world` holds the scene and the vehicle; its clearance is replaced by each
/// method's in turn. `parallel` runs over the pairs; the result does not depend on it, but for planning_ms.
SceneComparison compare_scene(const std::string& scene, const plan::World& as_built,
                              const std::vector<RoutePair>& pairs, const std::vector<CompareMethod>& methods,
                              const Parallel& parallel = run_serial);

/// The narrow gap of the paper's figures, flown again and again in other air.
struct GapCampaign {
  std::string vehicle;
  std::size_t flights = 0;  ///< flown; a plan that failed is none
  std::size_t samples = 0, outside = 0, contacts = 0;
  Vec3 largest_ratio = Vec3::Zero();  ///< largest |e|/h per axis of all flights
  std::vector<track::Inside> shown;   ///< of the first flight, every 20 ms
};
/// Plans and flies (1, 0, 1.2) → (5, 0, 1.2) with seeds seed, seed + 2 … `world`: builtin:narrow-gap with sets.
GapCampaign fly_narrow_gap(const plan::World& world, std::size_t flights, std::uint64_t seed);

}  // namespace backwash::sim

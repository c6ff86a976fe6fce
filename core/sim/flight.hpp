// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <variant>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/plan/planner.hpp"
#include "core/sim/airflow_truth.hpp"
#include "core/sim/model_air.hpp"
#include "core/sim/vehicle/air_terms.hpp"
#include "core/sim/vehicle/quadrotor.hpp"
#include "core/sim/vehicle/sensors.hpp"
#include "core/sim/vehicle/vio.hpp"
#include "core/track/tracker.hpp"

namespace backwash::sim {

/// What a log row holds: the vehicle at a tick and the command it gets there.
struct FlightSample {
  double t;                     ///< s
  std::optional<int> segment;   ///< hover position number; none in transit
  State truth;                  ///< where the vehicle really is
  State estimated;              ///< what VIO says: feeds the controller and is judged
  Vec3 acceleration;            ///< m/s², W, gravity removed
  Eigen::Quaterniond attitude;  ///< body to world
  double thrust;                ///< normalised collective command
  Setpoint command;
  RotorReadings rotors{};
};

/// What a simulation is made of beside the vehicle file.
struct Simulation {
  double strength = 1;                     ///< factor on the variance of the airflow
  std::vector<SimulationTerm> terms = {};  ///< of an extended model, in either air
  ModelField* air = nullptr;               ///< gusts of this Σ instead of the airflow truth's; it must outlive them
  std::optional<double> hover_rpm = {};    ///< of the rotors; without it a typical one
};

/// Vehicle, air and emulated VIO in one closed loop: commands at 50 Hz, physics at 1 kHz.
class ClosedLoop {
 public:
  ClosedLoop(const map::OccupancyGrid& grid, const Vehicle& vehicle, const State& start, std::uint64_t seed,
             const Simulation& simulation = {});
  const State& estimated() const noexcept { return estimated_; }
  double time() const noexcept { return quadrotor_.time(); }  ///< s
  /// The vehicle now; `command` and `segment` are what the caller is about to fly.
  FlightSample sample(const Setpoint& command, std::optional<int> segment);
  /// Issues a command and moves on by one control period (20 ms).
  void fly(const Setpoint& command);

  /// What a flight that is flown again tells and no simulation knows, from now on: the heading (rad), the battery's
  /// voltage (V), the sensor's temperature (°C).
  void set_conditions(double yaw, std::optional<double> voltage, std::optional<double> temperature);
  /// Issues a command and moves on by one Quadrotor::kStep.
  void step(const Setpoint& command);

 private:
  void step();
  Quadrotor quadrotor_;
  std::variant<AirflowTruth, ModelAir> air_;
  AirTerms air_terms_;
  Sensors sensors_;
  EmulatedVio vio_;
  State estimated_;
  std::optional<double> temperature_;
};

/// One command, `seconds` long.
std::vector<Setpoint> hold_commands(const Vec3& at_W, double seconds);

/// Columns of docs/interfaces.md, "Flight log, CSV"; position, velocity and attitude as estimated on board. `rotors`:
/// with motor and rpm columns.
log::FlightLog to_log(const std::vector<FlightSample>& samples, bool rotors = false);

struct FlightOptions {
  Vec3 start_W, goal_W;                    ///< hover points, m
  std::uint64_t seed = 1;                  ///< of the airflow and the VIO error
  double sigma_scale = 1;                  ///< judge with sets of Σ·sigma_scale: below 1 a mutant that must be caught
  std::vector<SimulationTerm> terms = {};  ///< of an extended model: what the vehicle and its air do beside their own
  plan::PlanOptions limits;
  double settle_s = 2;  ///< hover at the start, s
  double hold_s = 3;    ///< hover at the goal, s
};

/// One accepted piece of the flight and what was measured on it: sample k meets entry k of the tube.
struct FlightPiece {
  track::AcceptedSegment accepted;    ///< the tube that it is judged with
  std::vector<FlightSample> samples;  ///< one per entry of the tube
  std::vector<track::Inside> judged;  ///< one per sample
  std::vector<double> clearance_m;    ///< truth to the obstacles that count − body radius, one per sample
};

/// `z_safe` of what is no take-off: clearance counts all around.
inline constexpr double kEverywhere = -std::numeric_limits<double>::infinity();

/// Flies a piece whose tube was propagated from the loop's estimate at its acceptance, and judges every measured
/// position against it. `t_start`: of its first sample, s; `z_safe`: see true_clearance; samples from `hover_from` on
/// carry the segment `hover_number`, those before none.
FlightPiece fly_piece(ClosedLoop& loop, const plan::World& world, track::AcceptedSegment accepted, double t_start,
                      double z_safe, std::size_t hover_from, int hover_number);

/// What one method says about the route, from the state estimated when it was accepted.
struct MethodTube {
  reach::ReachTube tube;
  double clearance_m;          ///< of the swept tube; > 0: clear
  double tube_ms;              ///< time to propagate it
  double largest_half_axis_m;  ///< largest half width on an axis for tight, √λ_max for paper
};

/// A whole flight: vertical take-off with a settling hover, then the planned route with a hold at the goal.
struct Flight {
  plan::TakeoffColumn column;
  plan::Plan plan;
  FlightPiece take_off, route;
  MethodTube tight;  ///< flown: what the route was planned and accepted with
  MethodTube paper;  ///< on the same commands, beside the flight
};

/// The tube of a method along commands, timed and measured.
MethodTube method_tube(const plan::World& world, const reach::Reachability& reach, const State& start,
                       const Setpoint& previous, const std::vector<Setpoint>& commands);
/// Clearance of a true position, body to obstacle, m: beside it only below z_safe (the vehicle comes from the floor).
double true_clearance(const plan::World& world, const Vec3& p_W, double z_safe);

/// Why no flight took place; one line that says where and what would be right.
struct FlightRefused {
  std::string message;
};

/// Vertical commands from the floor under the start up to it, and a settling hover there.
struct TakeOff {
  plan::TakeoffColumn column;
  Setpoint ground;  ///< at rest on the floor
  std::vector<Setpoint> commands;
  std::size_t risen;   ///< commands before the hover
  double clearance_m;  ///< of the tube from exactly the ground point
};
/// Refused where there is no known floor, or where the tube of a vehicle that knows its position exactly is not clear:
/// beside it below z_safe, all around above (docs/model.md section 4).
tl::expected<TakeOff, FlightRefused> take_off(const plan::World& world, const FlightOptions& options);

/// Checks start, goal and take-off column, takes off, settles, plans from the estimated state, follows and holds: one
/// closed-loop flight, deterministic for its options but for the planner's deadline. The vehicle waits at its set-point
/// while the plan is made, so planning takes no simulated time.
tl::expected<Flight, FlightRefused> fly(const plan::World& world, const Vehicle& vehicle, const BoundModel& bounds,
                                        const FlightOptions& options);

/// The flight in figures.
struct FlightSummary {
  double length_m, time_s;      ///< path really flown, and the flight's duration, take-off to the end of the hold
  double clearance_m;           ///< smallest true clearance on the route, body to obstacle
  double take_off_clearance_m;  ///< during take-off and settling; below z_safe lateral only
  Vec3 largest_ratio;           ///< largest |e|/h per axis
  std::size_t samples, inside;
  double goal_error_m;  ///< truth to goal at the end
  bool goal_reached, touched;
  bool ok() const noexcept { return goal_reached && !touched && inside == samples; }
};
FlightSummary summarise(const Flight& flight, const plan::World& world, const Vec3& goal_W);

}  // namespace backwash::sim

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "core/map/distance_field.hpp"
#include "core/sim/airflow_truth.hpp"
#include "core/sim/vehicle/vio.hpp"
#include "core/types/state.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::race {

inline constexpr int kSteps = 4;          ///< of integration, a control period
inline constexpr double kLattice = 0.05;  ///< m: the flow is cast at the nearest point of it; 0: where the vehicle is

/// A vehicle in rough air, as core/sim/closed_loop flies it but in larger steps.
/// VIO: drift of 3/4 of estimation.position at most, noise for the rest at each tick, 0.01 m/s on the velocity.
class Flown {
 public:
  Flown(const map::OccupancyGrid& grid, const Vehicle& vehicle, const Vec3& at_W, std::uint64_t seed, double strength,
        int steps = kSteps, double lattice = kLattice);
  /// One control period.
  void fly(const Setpoint& command);
  const State& truth() const noexcept { return truth_; }
  /// The disturbance's mean over the period, as an accelerometer of 0.02 m/s² of noise tells it, m/s².
  const Vec3& felt() const noexcept { return felt_; }

 private:
  Vec3 wanted(const State& believed) const noexcept;
  const Vehicle& vehicle_;
  int steps_;
  double lattice_;
  sim::AirflowTruth air_;
  sim::EmulatedVio vio_;
  std::mt19937_64 random_;
  State truth_;
  Vec3 produced_ = Vec3::Zero(), felt_ = Vec3::Zero();
  Setpoint active_;
  std::deque<std::pair<long, Setpoint>> in_transit_;
  std::deque<State> late_;
  long step_ = 0;
};

/// Hovers one second, flies the commands; whether the body touched on the way. Ends at the first contact.
bool touches(const map::OccupancyGrid& grid, const map::DistanceField& distance, const Vehicle& vehicle,
             std::span<const Setpoint> commands, const Vec3& start_W, std::uint64_t seed, double strength);

/// Mean and variance of what is felt while hovering for 22 s, from the third second on.
std::pair<Vec3, Vec3> hover_disturbance(const map::OccupancyGrid& grid, const Vehicle& vehicle, const Vec3& at_W,
                                        std::uint64_t seed, double strength);

}  // namespace backwash::race

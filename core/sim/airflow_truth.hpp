// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>

#include "core/map/occupancy_grid.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::sim {

/// What really shakes the simulated vehicle. Its formulas are not the model's (core/sim/README.md says how they
/// differ): own decay laws in the distances found by casting rays, intermittent gusts, heavy-tailed variance, a mean
/// push.
class AirflowTruth {
 public:
  AirflowTruth(const map::OccupancyGrid& grid, const Vehicle& vehicle, std::uint64_t seed);
  /// Disturbance acceleration over the next dt (s) at p, m/s² in W. Deterministic for a seed and a call sequence.
  Vec3 step(const Vec3& p_W, double dt);
  /// Long-time variance of step() per axis at p, (m/s²)²: for tests and docs, never read by the estimator.
  Vec3 variance(const Vec3& p_W) const;

 private:
  const map::OccupancyGrid* grid_;
  double strength_;
  std::mt19937_64 rng_;
  Vec3 gust_ = Vec3::Zero();
  double log_intensity_ = 0, burst_ = 0;
};

}  // namespace backwash::sim

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <random>
#include <utility>

#include "core/map/occupancy_grid.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::sim {

/// What really shakes the simulated vehicle. Its formulas are not the model's (core/sim/README.md says how they
/// differ): own decay laws in the distances found by casting rays, intermittent gusts, heavy-tailed variance, a mean
/// push.
class AirflowTruth {
 public:
  /// Largest gust, in long-time standard deviations: what the rotors can throw is finite. In the horizontal plane it
  /// limits the gust's norm, so it holds in every direction.
  static constexpr double kLargestGust = 3.2;

  /// The grid must outlive it. Only the vehicle's rotor radius matters: it sets the strength of the wash. `strength`: a
  /// further factor on all variances, for days that differ.
  AirflowTruth(const map::OccupancyGrid& grid, const Vehicle& vehicle, std::uint64_t seed, double strength = 1);
  /// Disturbance acceleration over the next dt (s) at p, m/s² in W. Deterministic for a seed and a call sequence; its
  /// statistics do not depend on dt. `gust`: factor on the gusts, not on the mean.
  Vec3 step(const Vec3& p_W, double dt, double gust = 1);
  /// Long-time variance of step() per axis at p, (m/s²)²: for tests and docs, never read by the estimator.
  Vec3 variance(const Vec3& p_W) const;
  /// Long-time mean of step() at p, m/s²: for tests and docs, never read by the estimator.
  Vec3 mean(const Vec3& p_W) const;

 private:
  /// Flow at a point for strength 1: covariance of the gust (z uncorrelated with x and y) and mean push.
  struct Flow {
    double xx, xy, yy, zz;
    Vec3 mean;
  };
  /// Flow is cast anew when the vehicle has moved this far: 29 rays cost 10 µs.
  static constexpr double kRecast = 0.005;  // m
  Flow flow(const Vec3& p_W) const;
  void advance(double dt);

  const map::OccupancyGrid* grid_;
  double strength_;  // factor on the variance
  std::mt19937_64 rng_;
  std::normal_distribution<double> normal_;
  Vec3 gust_, gust_rate_;  // unit variance; 1/s
  double log_intensity_;   // slow modulation
  bool bursting_ = false;
  double burst_ = 0;                                // smoothed bursting_
  std::optional<std::pair<Vec3, Flow>> last_cast_;  // where, and what it found
};

}  // namespace backwash::sim

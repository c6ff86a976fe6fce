// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <random>

#include "core/sim/model_field.hpp"

namespace backwash::sim {

/// Air exactly as the model says: Gaussian gusts of covariance Σ and correlation e^{−|τ|/τ_w}, no mean (docs/model.md
/// 6-9). It is the base simulation that a study judges; AirflowTruth is what a vehicle is flown against.
class ModelAir {
 public:
  /// The field must outlive it.
  ModelAir(ModelField& field, std::uint64_t seed);
  /// Disturbance acceleration over the next dt (s) at p, m/s² in W. `gust`: factor on the standard deviation.
  Vec3 step(const Vec3& p_W, double dt, double gust = 1);

 private:
  static constexpr double kRecast = 0.005;  // m
  ModelField* field_;
  std::mt19937_64 rng_;
  std::normal_distribution<double> normal_;
  Vec3 gust_;                                     // variance 1
  std::optional<std::pair<Vec3, Mat3>> last_at_;  // where, and the root of Σ there
};

}  // namespace backwash::sim

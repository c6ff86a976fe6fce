// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "core/field/sight/around.hpp"
#include "core/types/simulation_term.hpp"

namespace backwash::sim {

/// What an extended model's terms make of the air (docs/model.md 6-10 to 6-12): a push, a factor of the gusts, and
/// where their variance is looked up. Without such terms: no push, 1, and the vehicle's own place.
class AirTerms {
 public:
  /// The grid must outlive it. `seed`: of the bursts.
  AirTerms(const map::OccupancyGrid& grid, std::span<const SimulationTerm> terms, std::uint64_t seed);

  struct Now {
    Vec3 push_W = Vec3::Zero();  ///< m/s²
    double gust = 1;             ///< on the standard deviation of the gusts
    Vec3 place_W;                ///< where Σ is looked up, m
  };
  /// The next dt (s).
  Now step(const FlightInstant& now, double dt);

 private:
  /// Bursts of unit mean square: two states, short and loud, long and calm.
  struct Bursts {
    double loud, calm;         // standard deviations
    double mean_on, mean_off;  // s
    bool on = false;
  };
  static constexpr double kRecast = 0.005;  // m
  const Around& around(const Vec3& p_W);
  Vec3 moved(const Vec3& p_W, const Vec3& offset_W) const;

  const map::OccupancyGrid* grid_;
  std::vector<SimulationTerm> terms_;
  Sight sight_{0, 0, 0};
  std::vector<Bursts> bursts_;
  std::mt19937_64 rng_;
  std::optional<std::pair<Vec3, Around>> last_look_;
};

}  // namespace backwash::sim

// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/vehicle/vio.hpp"

#include <numbers>
#include <random>

namespace backwash::sim {

// The waves of an axis together stay below bound/√3, so that the norm stays below the bound.
EmulatedVio::EmulatedVio(double position_bound, std::uint64_t seed)
    : amplitude_(position_bound / (std::numbers::sqrt3 * kWaves)) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> frequency(0.02, 0.2), phase(0, 2 * std::numbers::pi);
  for (auto& axis : waves_)
    for (Wave& wave : axis) {
      wave.omega = 2 * std::numbers::pi * frequency(rng);
      wave.phase = phase(rng);
    }
}

State EmulatedVio::estimate(const State& truth, double time) const noexcept {
  State estimated = truth;
  for (int axis = 0; axis < 3; ++axis)
    for (const Wave& wave : waves_[static_cast<std::size_t>(axis)]) {
      estimated.p_W[axis] += amplitude_ * std::sin(wave.omega * time + wave.phase);
      estimated.v_W[axis] += amplitude_ * wave.omega * std::cos(wave.omega * time + wave.phase);
    }
  return estimated;
}

}  // namespace backwash::sim

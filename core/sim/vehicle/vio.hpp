// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "core/types/state.hpp"

namespace backwash::sim {

/// Emulated visual-inertial estimate: the true state plus a drift that is smooth, slow (at most 0.2 Hz) and bounded.
/// Its velocity error is the derivative of its position error.
class EmulatedVio {
 public:
  /// `position_bound`: largest norm of the position error, m, ≥ 0.
  EmulatedVio(double position_bound, std::uint64_t seed);
  /// What the estimator reports at `time` (s). The error depends on the time alone.
  State estimate(const State& truth, double time) const noexcept;

 private:
  static constexpr int kWaves = 4;  // per axis
  struct Wave {
    double omega, phase;
  };
  double amplitude_;  // of one wave, m
  std::array<std::array<Wave, kWaves>, 3> waves_;
};

}  // namespace backwash::sim

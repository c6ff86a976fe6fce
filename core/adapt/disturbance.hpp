// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>

#include "core/types/state.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::adapt {

/// What a tick knows of the flight.
struct FlownSample {
  double t_s = 0;           ///< rising
  State state;              ///< as measured
  Vec3 a_W = Vec3::Zero();  ///< m/s², gravity removed
  Setpoint command;         ///< sent at t_s
};

/// The disturbance by samples, docs/model.md 3-1: what the set-points and the measured state, as old as the vehicle
/// file says, leave over of the acceleration.
class Disturbance {
 public:
  static constexpr double kGap = 0.3;    ///< s: after it all begins anew
  static constexpr double kSettled = 6;  ///< attitude lags, and
  static constexpr double kLeast = 0.2;  ///< s at least, that pass before anything is told
  explicit Disturbance(const Vehicle& vehicle) : controller_(vehicle.controller) {}

  /// w, m/s² in W; nothing until delays and lag have passed since a gap, and for a sample that is not finite or not
  /// later than the one before. Real-time: wait-free, no allocation.
  std::optional<Vec3> add(const FlownSample& sample) noexcept;

 private:
  static constexpr std::size_t kKept = 128;
  const FlownSample& back(std::size_t n) const noexcept { return kept_[(newest_ + kKept - n) % kKept]; }
  /// The samples around a time and the share of the way between them; the oldest kept before that.
  struct Around {
    const FlownSample &before, &after;
    double share;
  };
  Around around(double t_s) const noexcept;
  Vec3 commanded(double now_s) const noexcept;

  decltype(Vehicle::controller) controller_;
  std::array<FlownSample, kKept> kept_;
  std::size_t newest_ = 0, count_ = 0;
  double begun_s_ = 0;
  Vec3 rotors_ = Vec3::Zero(), last_ = Vec3::Zero();
};

}  // namespace backwash::adapt

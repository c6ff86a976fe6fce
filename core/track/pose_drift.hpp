// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <numbers>

#include "core/track/rebase.hpp"
#include "core/types/state.hpp"

namespace backwash::track {

/// How far a pose may leave the way that its own twist claims (docs/model.md 4-18). A log says which law it was decided
/// by.
struct DriftLaw {
  /// Standard deviations: three axes that wander as modelled leave them on one of the scales once in 1000 h.
  static constexpr double kDeviations = 6.43;
  /// Of estimation.position, of which a third is one standard deviation, at both ends of the way.
  double ends = kDeviations * std::numbers::sqrt2 / 3;
  double deviations = kDeviations;       ///< of the twist's own error, added up
  double scale = 0.02;                   ///< share of the way by which twist and pose may disagree for ever
  double lag = 0.03;                     ///< s by which the twist may be late or early
  std::array<double, 3> over{1, 5, 20};  ///< s, over which what was fades
};

/// What logs were decided by that name no law: over a second, whatever the estimator says of its twist.
inline constexpr DriftLaw kDriftOverASecond{5, 0, 0, 0, {1, 1, 1}};

/// Holds the displacement of a pose against the integral of its own velocity, on every scale of the law at once: a sum
/// that fades, and beside it what explains one. Real-time: wait-free, no allocation, O(1).
class PoseDrift {
 public:
  /// A velocity's error lasts so long, s: a position error takes as long to build up.
  static constexpr double kSettle = 0.5;
  /// From one sample to the next, in one frame.
  struct Step {
    double dt = 0;                ///< s
    Vec3 moved = Vec3::Zero();    ///< of the pose, m
    Vec3 claimed = Vec3::Zero();  ///< integral of the twist, m
    Vec3 change = Vec3::Zero();   ///< of the twist, m/s
    double velocity_error = 0;    ///< one standard deviation of the twist along an axis, m/s
  };

  /// `position`: estimation.position of the vehicle, m.
  PoseDrift(double position, const DriftLaw& law) noexcept : position_(position), law_(law) {}

  /// A twist's error where its estimator does not say one, m/s: what makes a third of `position` in kSettle.
  static double velocity_error(double position) noexcept { return position / 3 / kSettle; }
  /// Least rate of a drift that lasts and is found in the end, m/s.
  static double slowest(double position, double velocity_error, const DriftLaw& law = {}) noexcept;

  /// False: the pose has left what the twist claims, and the step is not added.
  bool explains(const Step& step) noexcept;
  /// The map moved under the vehicle: map_new ← map_old.
  void rebase(const RigidShift& D) noexcept;
  void begin_anew() noexcept { scales_ = {}; }

 private:
  struct Scale {
    Vec3 left = Vec3::Zero();    ///< moved less claimed, m
    Vec3 way = Vec3::Zero();     ///< claimed, m
    Vec3 change = Vec3::Zero();  ///< of the twist, m/s
    double variance = 0;         ///< of `left` by the twist's own error, m²
  };

  double position_;
  DriftLaw law_;
  std::array<Scale, 3> scales_{};
};

}  // namespace backwash::track

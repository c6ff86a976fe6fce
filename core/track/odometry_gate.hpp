// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/track/rebase.hpp"
#include "core/types/state.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::track {

/// One odometry message, in the map frame.
struct OdometrySample {
  std::int64_t received_ns = 0;         ///< CLOCK_MONOTONIC
  std::int64_t stamp_ns = 0;            ///< the sender's stamp, by the sender's clock
  State state;                          ///< m, m/s
  std::array<double, 4> q{1, 0, 0, 0};  ///< body to map: w, x, y, z
  std::uint32_t closures = 0;           ///< loop closures so far: which map frame this is in
  RigidShift map_from_odom{};           ///< by which the VIO's own pose was brought there
};

/// Lets only credible odometry through (faults.md rows 2, 3, 5, 6). It sees the newest sample of each tick. Real-time:
/// wait-free, no allocation.
class OdometryGate {
 public:
  enum class Verdict : std::uint8_t {
    good,
    rejected,  ///< not finite, or the quaternion is not unit
    disorder,  ///< the stamp does not rise
    frozen,    ///< the kFrozen-th identical pose in a row, or a later one, while the vehicle is commanded to move
    jump,      ///< further from the last good sample's prediction than v_max·dt + 3σ
  };
  static constexpr int kFrozen = 5;          ///< row 6
  static constexpr double kClockStep = 0.5;  ///< s

  explicit OdometryGate(const Vehicle& vehicle) noexcept
      : v_max_(vehicle.limits.v_max), sigma_(vehicle.estimation.position) {}

  /// Judges one sample; only a good one becomes last(). dt is the stamps' difference, or, where that is more than
  /// kClockStep off the receptions' difference, the latter: then the sender's wall clock was set (row 30).
  Verdict take(const OdometrySample& sample, bool moving) noexcept;
  /// The last good sample.
  const std::optional<OdometrySample>& last() const noexcept { return last_; }
  /// The map moved under the vehicle (loop closure): the last sample is what it would have said. map_new ← map_old.
  void rebase(const RigidShift& D) noexcept;
  /// After a jump: the next sample is believed whatever it says. Only while nothing is commanded.
  void forget() noexcept { last_.reset(); }

 private:
  double v_max_, sigma_;
  std::optional<OdometrySample> last_;
  int identical_ = 0;
};

}  // namespace backwash::track

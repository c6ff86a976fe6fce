// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "core/track/pose_drift.hpp"
#include "core/types/odometry_timing.hpp"
#include "core/types/state.hpp"
#include "core/types/time.hpp"
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
  /// As the VIO says, of each axis: m², rad² of its own frame, (m/s)² of the body. Absent: it does not say. The
  /// autopilot's estimator gets them; of our decisions one rests on the velocity's.
  std::optional<Vec3> position_variance{}, attitude_variance{}, velocity_variance{};
};

/// Lets only credible odometry through (docs/faults.md rows 2, 3, 5, 6, 41, 49, 57). It sees the newest sample of each
/// tick. Real-time: wait-free, no allocation.
///
/// Its noise level is σ = estimation.position. A position error of σ takes half a second or more to build up, so the
/// velocity is good to σ_v = σ / 0.5 s.
class OdometryGate {
 public:
  enum class Verdict : std::uint8_t {
    good,
    rejected,      ///< not a number, or the quaternion is not unit
    disorder,      ///< the stamp does not rise
    frozen,        ///< too many identical poses in a row while the vehicle is commanded to move: the kFrozen-th, and of
                   ///< slower odometry an earlier one
    jump,          ///< in position, velocity or attitude: further from the last good sample than the vehicle can get
    inconsistent,  ///< the way that the positions went is not what the velocities claim, over 1, 5 or 20 s
  };
  static constexpr int kFrozen = 5;          ///< row 6, at OdometryTiming::kUsual: 0.2 s from the first to the last
  static constexpr double kClockStep = 0.5;  ///< s
  /// rad/s about the vertical: autopilots turn at most at 200°/s (PX4's MC_YAWRATE_MAX), our flights at 1 rad/s.
  static constexpr double kMaxYawRate = 3;
  static constexpr double kMaxTiltRate = 15;      ///< rad/s: a racing quadrotor's 860°/s
  static constexpr double kAngleNoise = 0.06;     ///< rad, between two samples
  static constexpr double kMaxAcceleration = 15;  ///< m/s²: tilted by 45° and thrust of two weights, √2 g, and gusts
  static constexpr double kVelocityNoises = 4;    ///< σ_v between two samples: 3 √2
  static constexpr double kOverspeed = 4;         ///< of v_max: no flight of ours, nor what a gust adds to one
  static constexpr double kLongestStep = 0.1;     ///< s between two samples that are still held against each other

  explicit OdometryGate(const Vehicle& vehicle, const OdometryTiming& timing = {}, const DriftLaw& law = {}) noexcept
      : v_max_(vehicle.limits.v_max),
        sigma_(vehicle.estimation.position),
        longest_step_(kLongestStep + timing.longer_gap()),
        frozen_(1 + static_cast<int>(std::ceil((kFrozen - 1) / timing.usual_samples()))),
        drift_(vehicle.estimation.position, law) {}

  /// Judges one sample; only a good one becomes last(). dt is the stamps' difference, at most the receptions' and what
  /// the last sample was late: a stamp ahead of that widens nothing (row 49). Where the two are more than kClockStep
  /// apart it is the receptions': then the sender's wall clock was set (row 30).
  Verdict take(const OdometrySample& sample, bool moving) noexcept;
  /// The last good sample.
  const std::optional<OdometrySample>& last() const noexcept { return last_; }
  /// How much longer the newest sample took from its stamp to its reception than the fastest one so far, s, ≥ 0 (row
  /// 49). Clocks that differ by up to 100 ppm add nothing.
  double late() const noexcept { return seconds(late_ns_); }
  /// The map moved under the vehicle (loop closure): the last sample is what it would have said. map_new ← map_old.
  void rebase(const RigidShift& D) noexcept;
  /// After a jump: the next sample is believed whatever it says. Only while nothing is commanded.
  void forget() noexcept {
    last_.reset();
    fastest_ns_.reset();
    drift_.begin_anew();
  }

 private:
  bool jumps(const OdometrySample& sample, double dt) const noexcept;
  bool contradicts(const OdometrySample& sample, double dt) noexcept;
  void time(const OdometrySample& sample, bool clock_was_set) noexcept;

  double v_max_, sigma_, longest_step_;
  int frozen_;  ///< identical poses that are one too many: of slower odometry fewer, in no more than the same time
  std::optional<OdometrySample> last_;
  int identical_ = 0;
  std::optional<std::int64_t> fastest_ns_;  ///< least reception − stamp, which is the clocks' difference and the way
  std::int64_t late_ns_ = 0;
  PoseDrift drift_;
};

/// The sample as it would be in a frame moved by D. Real-time: wait-free, no allocation.
OdometrySample moved(const RigidShift& D, OdometrySample sample) noexcept;
/// Heading of a body-to-world quaternion (w, x, y, z), rad. Real-time: wait-free, no allocation.
double heading(const std::array<double, 4>& q) noexcept;
/// The world's z axis in the body. Real-time: wait-free, no allocation.
Vec3 up_in_body(const std::array<double, 4>& q) noexcept;

}  // namespace backwash::track

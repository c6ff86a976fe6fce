// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "core/track/rebase.hpp"
#include "core/types/angle.hpp"
#include "core/types/mode.hpp"
#include "core/types/odometry_timing.hpp"
#include "core/types/state.hpp"

namespace backwash::track {

/// Motion of one body in one frame at one moment; both frames are z-up, so they differ by a yaw and a translation.
struct FramePose {
  Vec3 p = Vec3::Zero();      ///< m
  double yaw = 0;             ///< rad
  Vec3 v = Vec3::Zero();      ///< m/s
  Vec3 up_B = Vec3::UnitZ();  ///< the frame's z axis in the body's, x forward, y left
  double yaw_rate = 0;        ///< as the autopilot's gyros measure it, rad/s; in_local only
};

/// Estimates local ← map, p_local = R_z(yaw) p_map + t, from the vehicle's pose in both frames at the same moments
/// (docs/interfaces.md, "Frames between map, odometry and controller"). While learning it follows the newest samples;
/// frozen, it only watches how well they still agree.
class FrameAlignment {
 public:
  static constexpr double kMaxPosition = 0.05;      ///< m: aligned below this residual
  static constexpr double kMaxYaw = 3.0 * kDegree;  ///< rad
  static constexpr int kMinSamples = 25;            ///< half a second at 50 Hz
  /// A single pair further apart than three times the above is no noise.
  static constexpr double kResetPosition = 3 * kMaxPosition, kResetYaw = 3 * kMaxYaw;
  static constexpr double kMaxTilt = 5.0 * kDegree;  ///< rad
  /// Turn of the odometry beyond the gyros', rad, fading over kTurnOver: 1 rad/s and 50 ms between the two, or a drift
  /// of 0.8°/s.
  static constexpr double kMaxGyroTurn = 4.0 * kDegree, kTurnOver = 5.0;
  static constexpr double kMaxTurn = 10.0 * kDegree;               ///< rad, between the velocities' directions
  static constexpr double kExcited = 25 * 0.15 * 0.15;             ///< (m/s)²: half a second at 0.15 m/s
  static constexpr double kLeastGain = 0.5, kLeastRotation = 0.8;  ///< of velocity, both 1 in a perfect match

  /// Of slower odometry each pair counts for as many as would have come at OdometryTiming::kUsual.
  explicit FrameAlignment(const OdometryTiming& timing = {}) noexcept;

  /// One pair of poses, `dt` s after the last. Real-time: wait-free, no allocation.
  void update(const FramePose& in_map, const FramePose& in_local, double dt, bool learn) noexcept;
  /// Takes local ← map anew from this one pair. Real-time: wait-free, no allocation.
  void rebase(const FramePose& in_map, const FramePose& in_local) noexcept;
  /// The map moved under the vehicle (loop closure), the controller's frame did not: local ← map_new, for
  /// D = map_new ← map_old. Real-time: wait-free, no allocation.
  void rebase(const RigidShift& D) noexcept;
  /// This pair lies further from the transform than any noise. Real-time: wait-free, no allocation.
  bool reset_between(const FramePose& in_map, const FramePose& in_local) const noexcept;
  /// The controller's own estimate, `dt` s after the pair before, is not where its own velocity and gyros have carried
  /// it: it was reset, or follows something that jumped (docs/faults.md row 8). Real-time: wait-free, no allocation.
  bool local_jumped(const FramePose& in_local, double dt) const noexcept;
  /// Enough samples; their residuals and the two attitudes' tilt (low-passed over 0.2 s) are small; and the odometry
  /// has turned no further than the gyros say.
  bool aligned() const noexcept;
  /// The same in flight, where the autopilot's estimate wanders more: up to `position` m of residual.
  bool agree(double position) const noexcept;
  double position_residual() const noexcept { return position_residual_; }  ///< m
  double yaw_residual() const noexcept { return yaw_residual_; }            ///< rad

  /// What is wrong with the frames, from the correlation of the two velocities (over the last 5 s of motion while
  /// learning) and from the two attitudes' tilt (docs/faults.md row 7). Velocity is judged along directions in which
  /// the vehicle has moved; a vehicle that stood still shows its tilt only. Real-time: wait-free, no allocation.
  Mismatch mismatch() const noexcept;

  /// A command of the map frame in the controller's local frame. Real-time: wait-free, no allocation.
  Setpoint to_local(const Setpoint& in_map) const noexcept;

 private:
  Vec3 rotate(const Vec3& v) const noexcept;
  void watch_turn(const FramePose& in_map, const FramePose& in_local, double dt) noexcept;
  void watch_tilt(const FramePose& in_map, const FramePose& in_local) noexcept;
  void correlate(const FramePose& in_map, const FramePose& in_local) noexcept;
  Mismatch horizontal_mismatch() const noexcept;

  double learn_, watch_, fade_, longest_step_;
  int samples_ = 0;
  double yaw_ = 0;
  Vec3 translation_ = Vec3::Zero();
  double position_residual_ = 0, yaw_residual_ = 0;
  /// Forgetting sums over pairs of velocities, the local one turned into the map: local·mapᵀ, and map² per axis.
  Mat3 cross_ = Mat3::Zero();
  Vec3 energy_ = Vec3::Zero();
  double roll_ = 0, pitch_ = 0;  ///< tilt between the two, low-passed, rad
  double gyro_turn_ = 0;         ///< turn of the odometry beyond the gyros', fading, rad
  double map_yaw_ = 0;           ///< of the last pair
  FramePose local_;              ///< of the last pair
};

}  // namespace backwash::track

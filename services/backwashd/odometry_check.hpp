// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/config/odometry_profile.hpp"
#include "core/types/state.hpp"

namespace backwash::daemon {

/// Whether an estimator's odometry is what the configuration says (docs/faults.md row 53): a twist that is not there,
/// or is in another frame, and a rate at which each gap would be a HOLD. The motion that shows it is a walk with the
/// vehicle in the hands; standing still nothing is doubted. Pure: it knows the messages alone.
class OdometryCheck {
 public:
  static constexpr double kZeroWay = 0.3;       ///< m that a pose moves while a twist of zeros is believed
  static constexpr double kStretch = 0.1;       ///< m over which twist and pose are compared at once
  static constexpr std::size_t kStretches = 5;  ///< that are looked at together, the newest
  static constexpr double kFits = 0.2,
                          kOff = 0.5;       ///< error over way below which a twist fits; above which it does not
  static constexpr double kLeastRate = 20;  ///< Hz; between two samples 50 ms and what they are late: HOLD at 80 ms
  static constexpr double kLongest = 3;     ///< s for one stretch: slower than that nothing is compared

  explicit OdometryCheck(config::Twist twist) : twist_(twist) {}

  /// One message as it came: stamp, ns; pose and linear twist, m and m/s. Returns the doubt ("": there is none) if it
  /// has changed.
  std::optional<std::string> look(std::int64_t stamp_ns, const Vec3& p, const Eigen::Quaterniond& q, const Vec3& v);

 private:
  struct ComparedStretch {
    double way, in_body, in_world;  ///< m: of the pose; by what the twist, taken so, misses it
  };
  void compare(double dt, const Vec3& p, const Eigen::Quaterniond& q, const Vec3& v);
  std::string doubt() const;
  std::string twist_doubt() const;

  config::Twist twist_;
  std::optional<std::int64_t> stamp_ns_;
  std::optional<double> interval_;  ///< s between two messages, smoothed
  int intervals_ = 0;               ///< that it is of, up to as many as make it known
  std::optional<Vec3> zero_from_;   ///< where the twist began to be zero
  double zero_way_ = 0;
  Vec3 from_ = Vec3::Zero(), by_body_ = Vec3::Zero(), by_world_ = Vec3::Zero();
  double lasted_ = 0;
  std::array<ComparedStretch, kStretches> stretches_{};
  std::size_t count_ = 0;
  std::string told_;
};

}  // namespace backwash::daemon

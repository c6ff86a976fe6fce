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
/// or is in another frame, and a rate or a latency that the sets do not hold. The motion that shows a wrong twist is a
/// walk with the vehicle in the hands; standing still none is doubted. Pure: it knows the messages alone.
class OdometryCheck {
 public:
  static constexpr double kZeroWay = 0.3;       ///< m that a pose moves while a twist of zeros is believed
  static constexpr double kStretch = 0.1;       ///< m over which twist and pose are compared at once
  static constexpr std::size_t kStretches = 5;  ///< that are looked at together, the newest
  static constexpr double kFits = 0.2,
                          kOff = 0.5;            ///< error over way below which a twist fits; above which it does not
  static constexpr double kLatencyOff = 0.03;    ///< s by which the latency may differ from what is stated
  static constexpr std::size_t kLatencies = 20;  ///< whose least is the latency
  static constexpr double kLongest = 3;          ///< s for one stretch: slower than that nothing is compared

  explicit OdometryCheck(config::Twist twist, const OdometryTiming& timing = {}) : twist_(twist), timing_(timing) {}

  /// One message as it came: stamp, ns; pose and linear twist, m and m/s; `latency`: from its stamp to its reception,
  /// s, nothing where the sender's clock is not known. Returns the doubt ("": there is none) if it has changed.
  std::optional<std::string> look(std::int64_t stamp_ns, const Vec3& p, const Eigen::Quaterniond& q, const Vec3& v,
                                  std::optional<double> latency = {});

 private:
  struct ComparedStretch {
    double way, in_body, in_world;  ///< m: of the pose; by what the twist, taken so, misses it
  };
  void compare(double dt, const Vec3& p, const Eigen::Quaterniond& q, const Vec3& v);
  void time(std::optional<double> dt, std::optional<double> latency);
  std::string doubt();
  std::string timing_doubt();
  std::string twist_doubt() const;

  enum class Timing : std::uint8_t { right, slow, other_latency };

  config::Twist twist_;
  OdometryTiming timing_;
  std::optional<std::int64_t> stamp_ns_;
  std::optional<double> interval_;            ///< s between two messages, smoothed
  int intervals_ = 0;                         ///< that it is of, up to as many as make it known
  std::array<double, kLatencies> latency_{};  ///< s, of the newest messages, as a ring
  std::size_t latencies_ = 0;
  Timing timing_now_ = Timing::right;
  std::string timing_told_;        ///< with the value that was seen when it began
  std::optional<Vec3> zero_from_;  ///< where the twist began to be zero
  double zero_way_ = 0;
  Vec3 from_ = Vec3::Zero(), by_body_ = Vec3::Zero(), by_world_ = Vec3::Zero();
  double lasted_ = 0;
  std::array<ComparedStretch, kStretches> stretches_{};
  std::size_t count_ = 0;
  std::string told_;
};

}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>

#include "core/config/odometry_profile.hpp"
#include "core/track/odometry_gate.hpp"

namespace backwash::daemon {

/// What drift of a pose goes unnoticed (docs/faults.md row 57): told of the first sample, and again once the
/// estimator's own word of its velocity hides twice as much.
class DriftNotice {
 public:
  struct Notice {
    std::string line;
    bool warns = false;  ///< more than kMuch goes unnoticed
  };
  static constexpr double kMuch = 0.05;  ///< m/s

  /// `position`: estimation.position of the vehicle, m.
  DriftNotice(config::Twist twist, double position) : twist_(twist), position_(position) {}

  /// What is to be told of this sample; nothing: it has been told.
  std::optional<Notice> look(const track::OdometrySample& s) {
    using track::PoseDrift;
    const bool blind = twist_ == config::Twist::none;
    const double error =
        s.velocity_variance ? std::sqrt(s.velocity_variance->maxCoeff()) : PoseDrift::velocity_error(position_);
    const double slowest =
        blind ? std::numeric_limits<double>::max() : PoseDrift::slowest(position_, error, track::DriftLaw{});
    if (slowest <= told_) return std::nullopt;
    told_ = 2 * slowest;
    if (blind) return Notice{"the odometry has no twist: a pose that drifts is not noticed", true};
    char text[160];
    std::snprintf(text, sizeof text,
                  "a pose that drifts by less than %.3f m/s is not noticed: its velocity may be off by %.3f m/s%s",
                  slowest, error, s.velocity_variance ? ", it says" : " (estimation.position)");
    return Notice{text, slowest > kMuch};
  }

 private:
  config::Twist twist_;
  double position_, told_ = 0;
};

}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/types/state.hpp"

namespace backwash::track {

/// Velocity of a vehicle whose estimator tells positions alone (docs/model.md 4-12): a parabola by least squares
/// through the positions of the last kWindow, and its slope at the newest. Causal; without lag at constant
/// acceleration. Real-time: wait-free, no allocation; O(samples in the window).
class PoseVelocity {
 public:
  static constexpr double kWindow = 0.3;    ///< s
  static constexpr std::size_t kLeast = 4;  ///< samples
  static constexpr double kGap = 0.25;      ///< s between two samples after which it begins anew
  static constexpr double kNoise = 2e-3;    ///< m: error of a position that its neighbours do not share
  static constexpr double kJerk = 10;       ///< m/s³: of commands and gusts together

  /// Velocity at this sample, m/s, in the frame of the positions; nothing until kLeast samples fill two thirds of the
  /// window. A stamp that does not rise changes nothing and returns nothing.
  std::optional<Vec3> add(std::int64_t stamp_ns, const Vec3& p_W) noexcept;

  /// What it may be off along an axis at `rate` samples a second: three standard deviations of kNoise, and kJerk held
  /// over the window, m/s.
  static double error(double rate) noexcept;

 private:
  struct Sample {
    std::int64_t stamp_ns;
    Vec3 p_W;
  };
  static constexpr std::size_t kMost = 256;  // at 500 Hz the window holds 150
  std::array<Sample, kMost> samples_{};      // the newest count_ of them end before next_
  std::size_t next_ = 0, count_ = 0;
};

}  // namespace backwash::track

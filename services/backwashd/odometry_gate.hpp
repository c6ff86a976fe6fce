// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "core/types/vehicle.hpp"
#include "services/backwashd/channels.hpp"

namespace backwash::daemon {

/// Lets only credible odometry through (faults.md rows 2, 3, 5, 6). Real-time: wait-free, no allocation.
class OdometryGate {
 public:
  enum class Verdict { good, rejected, jump };

  explicit OdometryGate(const Vehicle& vehicle) noexcept
      : v_max_(vehicle.limits.v_max), sigma_(vehicle.estimation.position) {}

  /// Judges one sample. rejected: not finite, quaternion not unit, stamp not rising, or the fifth identical pose while
  /// `moving`; jump: further from the last good sample's prediction than v_max·dt + 3σ.
  Verdict take(const OdometrySample& sample, bool moving) noexcept;
  /// The last good sample.
  const std::optional<OdometrySample>& last() const noexcept { return last_; }
  /// After a jump: the next sample is believed whatever it says. Only while nothing is commanded.
  void forget() noexcept { last_.reset(); }

 private:
  double v_max_, sigma_;
  std::optional<OdometrySample> last_;
  int identical_ = 0;
};

}  // namespace backwash::daemon

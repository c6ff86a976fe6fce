// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "core/reach/error_dynamics.hpp"
#include "core/types/disturbance.hpp"
#include "core/types/geometry.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::reach {

/// The exact support of the position error in the five directions, propagated by the FIR of model.md section 5.2. The
/// responses must outlive it.
class SupportRecursion {
 public:
  /// Starts at the ellipsoid diag(position² I, velocity² I) of the vehicle's initial error. Allocates; nothing after
  /// does.
  SupportRecursion(const AxisResponse& horizontal, const AxisResponse& vertical, const Vehicle& vehicle);
  /// One step of 20 ms under w̄ (m/s²). O(min(k, N)) with 40 multiplications per past step.
  /// Real-time: wait-free, no allocation.
  void step(const DisturbanceBound& w_bar) noexcept;
  /// Half widths at the current sample instant, m. Exact; after N steps plus the tail. O(1).
  PerDirection half_widths() const noexcept;
  /// Half widths valid from the current sample instant until the next one, both included, if the next step's bound is
  /// `next`, m: the largest exact support at the kPhases instants of the step, plus δ²/8·|ë| between them (a chord's
  /// error, a few µm per m/s²). O(1).
  PerDirection half_widths_until_next(const DisturbanceBound& next) const noexcept;

 private:
  const AxisResponse& response(std::size_t direction) const noexcept {
    return direction == kZ ? *vertical_ : *horizontal_;
  }
  double initial(const AxisResponse& response, int phase) const noexcept;
  void sum_history(std::size_t direction) noexcept;

  const AxisResponse* horizontal_;
  const AxisResponse* vertical_;
  double position_, velocity_;
  std::size_t steps_ = 0;
  std::array<std::vector<double>, kDirections> history_;                        // newest last, at least the newest N
  PerDirection now_{};                                                          // Σ_j w̄_{k−1−j} G_j
  std::array<std::array<double, AxisResponse::kPhases>, kDirections> later_{};  // the past steps' part at phases 1 … 8
  PerDirection largest_{};                                                      // largest bound so far
  PerDirection largest_dropped_{};  // largest bound of the steps that only the tail covers
};

}  // namespace backwash::reach

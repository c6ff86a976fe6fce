// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/reach/response/error_dynamics.hpp"
#include "core/reach/support_filter.hpp"
#include "core/types/disturbance.hpp"
#include "core/types/geometry.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::reach {

/// The exact support of the position error in directions that share a response, propagated by docs/model.md
/// section 5.2.
template <std::size_t Lanes>
class SupportGroup {
 public:
  using Row = std::array<double, Lanes>;
  /// Starts at the ellipse diag(position², velocity²). Allocates; nothing after does.
  SupportGroup(const AxisResponse& response, double position, double velocity);
  /// See SupportRecursion. Real-time: wait-free, no allocation.
  void step(const Row& w_bar) noexcept;
  Row half_widths() const noexcept;
  Row half_widths_until_next(const Row& next) const noexcept;

 private:
  static constexpr int kPhases = AxisResponse::kPhases;
  /// The first set's part at the eight phases from `first` on.
  void look_up_initial(std::size_t first) noexcept;

  const AxisResponse* response_;
  double position_, velocity_;
  std::size_t steps_ = 0;
  SupportFilter<Lanes> filter_;
  std::array<double, kPhases + 1> initial_;  // part of the first set at phases 0 … 8 after the current sample
  Row now_{}, later_{};                      // the past steps' part at phases 0 and 8
  Row bulge_{};                              // by how much it may pass the chord between these
  Row largest_{};                            // largest bound so far
};

/// The exact support of the position error in the five directions. The responses must outlive it.
class SupportRecursion {
 public:
  /// Starts at the ellipsoid diag(position² I, velocity² I) of the vehicle's initial error. Allocates; nothing after
  /// does.
  SupportRecursion(const AxisResponse& horizontal, const AxisResponse& vertical, const Vehicle& vehicle);
  /// One step of 20 ms under w̄ (m/s²). Delay recursion: constant cost; FIR: O(min(k, N)), one multiplication per past
  /// step and direction. Real-time: wait-free, no allocation.
  void step(const DisturbanceBound& w_bar) noexcept;
  /// Half widths at the current sample instant, m. Exact but for the tail (< 1e-6 of the hover set's). O(1).
  PerDirection half_widths() const noexcept;
  /// Half widths valid from the current sample instant until the next one, both included, if the next step's bound is
  /// `next`, m: the largest support at the kPhases instants of the step, plus δ²/8·|ë| between them (a chord's error, a
  /// few µm per m/s²). Within 0.5 %, never below. O(1).
  PerDirection half_widths_until_next(const DisturbanceBound& next) const noexcept;

 private:
  SupportGroup<4> horizontal_;  // x, y and the diagonals
  SupportGroup<1> vertical_;
};

}  // namespace backwash::reach

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/reach/response/axis_step.hpp"
#include "core/types/disturbance.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::reach {

class BoundField;
struct FieldExtremes;
struct Reachability;

/// What the integrator of one axis' velocity loop holds: i = −c ∗ w under a disturbance w, ∫ c = 1, so that a steady
/// one is held off. Empty without an integrator.
struct IntegratorResponse {
  std::vector<double> kernel;    ///< ∫ |c| of each 20 ms of age
  std::vector<double> opposite;  ///< … of what of c is below 0, held the other way
  double manoeuvre = 0;  ///< most that is held under commands of 1 m/s² at most, streamed or held for 20 ms, in calm
  double from_position = 0, from_velocity = 0;  ///< … after an error of 1 m, 1/s², and of 1 m/s, 1/s
  double opposed() const;                       ///< sum of `opposite`
};

/// Responses by integration in steps of at most 1 ms, rounded up by 1 %: some ms. Errors: throws std::invalid_argument,
/// naming gains, delay and lag, if the loop does not settle within ten minutes: unstable, or the gain is too low.
IntegratorResponse integrator_response(const AxisLoop& axis);

/// The disturbance that the loop without its integrator sees: the air's less what the integrator holds (docs/model.md
/// section 4, equation 4-17). It may hold what blew elsewhere, so that the whole field's extremes are in it.
class NetDisturbance {
 public:
  /// O(kernel). The field's extremes are of vehicles within limits.v_max along each axis.
  NetDisturbance(const Reachability& reach, const BoundField& bounds);
  /// Of a field of which only the extremes are known.
  NetDisturbance(const Reachability& reach, const FieldExtremes& most, const BoundModel& model);
  /// False without an integrator: nothing is changed.
  bool held() const noexcept { return held_; }
  /// Bound on it where the air's own is w̄, without the known pushes: these are in what is added. Real-time: wait-free,
  /// no allocation.
  DisturbanceBound operator()(DisturbanceBound w_bar) const noexcept;

 private:
  bool held_ = false;
  PerDirection mean_{}, steady_{};            // m/s²
  PerDirection gusts_squared_{}, against_{};  // (s b)² and q b
};

/// Whether the vehicle's velocity loop has an integrator.
inline bool has_integrator(const Vehicle& v) noexcept { return v.controller.velocity_integrator.horizontal > 0; }

}  // namespace backwash::reach

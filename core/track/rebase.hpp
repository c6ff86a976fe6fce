// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "core/types/state.hpp"

namespace backwash::track {

/// A change of frame between two z-up frames: x ↦ R_z(yaw) x + t. Real-time: wait-free, no allocation.
struct RigidShift {
  double yaw = 0;         ///< rad
  Vec3 t = Vec3::Zero();  ///< m

  Vec3 rotate(const Vec3& v) const noexcept;
  Vec3 point(const Vec3& p) const noexcept { return rotate(p) + t; }
  State state(const State& s) const noexcept { return {point(s.p_W), rotate(s.v_W)}; }
  Setpoint setpoint(const Setpoint& s) const noexcept;
  RigidShift inverse() const noexcept;
};
/// First b, then a.
RigidShift operator*(const RigidShift& a, const RigidShift& b) noexcept;

/// Commands of a flight rectified after a loop closure (the paper's "commands are rectified according to the loop
/// closure results"): a flight planned in the map flies on, physically, where its commands were, at D·c with
/// D = map_new ← map_old; from `branch` on they go back smoothly to c, the place in the map that was planned:
///   c'_k = c_k + β_k (D c_k − c_k), β = 1 until `branch`, then 1 − (10 s³ − 15 s⁴ + 6 s⁵), s = (k − branch)/n,
/// with velocities, accelerations and yaw to match. n is the least for which no step from one command to the next is
/// longer than v_max · 0.02 s (or than the same step of c, where that is longer already); where the commands end
/// before, the last one is held until then. The way back alone takes at most half of a_max. Everything in the new map
/// frame. `v_max`: m/s; `a_max`: m/s².
std::vector<Setpoint> rectified(const std::vector<Setpoint>& commands, std::size_t branch, const RigidShift& D,
                                double v_max, double a_max);

}  // namespace backwash::track

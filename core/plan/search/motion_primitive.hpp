// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>

#include "core/types/state.hpp"

namespace backwash::plan {

/// A piece of motion: p(t) = c0 + c1 t + c2 t² + c3 t³ for t in [0, duration], W, SI units.
struct Motion {
  std::array<Vec3, 4> c;
  double duration;  ///< s

  Vec3 position(double t) const noexcept { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); }
  Vec3 velocity(double t) const noexcept { return c[1] + t * (2 * c[2] + 3 * t * c[3]); }
  Vec3 acceleration(double t) const noexcept { return 2 * c[2] + 6 * t * c[3]; }
  State end() const noexcept { return {position(duration), velocity(duration)}; }
  /// ∫ ‖u‖² dt over the piece, u the acceleration, m²/s³ (paper Eq. for G).
  double effort() const noexcept;
  /// Largest |velocity| and |acceleration| of each axis over the piece, exact.
  Vec3 peak_velocity() const noexcept;
  Vec3 peak_acceleration() const noexcept;
};

/// Exact axis-aligned bounds of a piece between two times.
struct Box {
  Vec3 low, high;  ///< m, W
};
Box bounds(const Motion& motion, double from, double to) noexcept;

/// Constant acceleration u from a state for a time.
Motion primitive(const State& from, const Vec3& u, double duration) noexcept;

/// The motion of least ∫‖u‖² dt from a state to rest at `goal_W` in exactly `duration`: u(t) = αt + β (paper Sec. V-A).
Motion optimal_cubic(const State& from, const Vec3& goal_W, double duration) noexcept;

/// Least value over T ≥ `least_duration` of ρT + min ∫‖u‖² dt from a state to rest at `goal_W`, and the T that has it
/// (paper Eq. for H, by the real roots of the quartic): a lower bound of the cost of any motion that takes at least
/// `least_duration`, hence admissible.
struct CostToGo {
  double cost;
  double duration;  ///< s
};
CostToGo cost_to_go(const State& from, const Vec3& goal_W, double rho, double least_duration) noexcept;

/// Least time in which a point can cover `distance` (m) and stop, from speed `speed`, with speed at most
/// max(v_max, speed) and acceleration at most a_max, s.
double least_stopping_time(double distance, double speed, double v_max, double a_max) noexcept;

/// Up to four numbers.
class Roots {
 public:
  void add(double x) noexcept { x_[count_++] = x; }
  const double* begin() const noexcept { return x_.data(); }
  const double* end() const noexcept { return x_.data() + count_; }
  std::size_t size() const noexcept { return count_; }

 private:
  std::array<double, 4> x_;
  std::size_t count_ = 0;
};
/// Real roots of x⁴ + p x² + q x + r (Ferrari, polished by Newton); multiple roots may appear once.
Roots depressed_quartic_roots(double p, double q, double r) noexcept;

}  // namespace backwash::plan

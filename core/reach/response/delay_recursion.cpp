// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/response/delay_recursion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/reach/response/axis_step.hpp"
#include "core/reach/response/response_builder.hpp"

namespace backwash::reach {
namespace {

struct HeldStep {
  Eigen::Matrix2d E;
  Eigen::Vector2d F;
};
// Over a time t under a constant input.
HeldStep step_over(double kp, double kd, double t) {
  const AxisStep step = axis_step({kp, kd, 0, 0}, true, t);
  return {step.E.topLeftCorner<2, 2>(), step.F.topLeftCorner<2, 1>()};
}

}  // namespace

std::optional<DelayRecursion> delay_recursion(double kp, double kd) {
  const HeldStep whole = step_over(kp, kd, kControlPeriod);
  DelayRecursion recursion{whole.E, whole.F, {}, 1, 0};
  const double sigma = kd / 2, omega_squared = kp - sigma * sigma;
  if (omega_squared <= 0) return recursion;

  const double T = std::numbers::pi / std::sqrt(omega_squared), rho = std::exp(-sigma * T);
  if (T <= kControlPeriod) return std::nullopt;
  const double h_inf = (1 + rho) / (1 - rho) / kp;  // coth(σT/2)/k_p
  const double largest_y = (1 / kp + h_inf) / 2;    // ∫ of the positive part of g
  const auto tail_after = [&](std::size_t M) {
    return 2 * std::pow(rho, static_cast<double>(M + 1)) / (1 - rho) * largest_y;
  };
  std::size_t M = 0;
  while (tail_after(M) > kTailShare * h_inf)
    if (++M > kMostEchoes) return std::nullopt;

  for (std::size_t m = 1; m <= M; ++m) {
    const double lag = static_cast<double>(m) * T;
    const double back = std::ceil(lag / kControlPeriod);
    const HeldStep part = step_over(kp, kd, back * kControlPeriod - lag);
    const double weight = 2 * std::pow(rho, static_cast<double>(m));
    recursion.echoes.push_back(
        {static_cast<std::size_t>(back), weight * part.E(0, 0), weight * part.E(0, 1), weight * part.F[0]});
  }
  const double covered = std::floor(static_cast<double>(M + 1) * T / kControlPeriod);
  recursion.memory = static_cast<std::size_t>(std::max(1.0, covered - 1));
  recursion.tail = tail_after(M);
  return recursion;
}

}  // namespace backwash::reach

// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/stop.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/types/angle.hpp"

namespace backwash::plan {
namespace {

// Command at path time σ (in commands): between two commands linear in each part; at rest after the end.
Setpoint at_path_time(const std::vector<Setpoint>& commands, double sigma) {
  const auto k = static_cast<std::size_t>(sigma);
  if (k + 1 >= commands.size()) return {commands.back().p_W, Vec3::Zero(), Vec3::Zero(), commands.back().yaw};
  const double f = sigma - static_cast<double>(k);
  const Setpoint &a = commands[k], &b = commands[k + 1];
  const double turn = wrap_angle(b.yaw - a.yaw);
  return {(1 - f) * a.p_W + f * b.p_W, (1 - f) * a.v_W + f * b.v_W, (1 - f) * a.a_W + f * b.a_W, a.yaw + f * turn};
}

}  // namespace

std::vector<Setpoint> stop_along(const std::vector<Setpoint>& commands, std::size_t branch, double a_max) {
  if (branch >= commands.size()) return {};
  double v = 0;
  for (std::size_t k = branch; k < commands.size(); ++k) v = std::max(v, commands[k].v_W.cwiseAbs().maxCoeff());
  // s(t) = (1 + cos(πt/T))/2 has max |ṡ| = π/(2T): T such that ṡ·v stays below a_max/2.
  const double T = std::max(0.2, std::numbers::pi * v / a_max);
  const auto steps = static_cast<std::size_t>(std::ceil(T / kControlPeriod));

  std::vector<Setpoint> stopped(commands.begin(), commands.begin() + static_cast<std::ptrdiff_t>(branch));
  for (std::size_t n = 0; n <= steps; ++n) {
    const double x = std::numbers::pi * std::min(1.0, static_cast<double>(n) * kControlPeriod / T);
    const double s = (1 + std::cos(x)) / 2;
    const double s_dot = -std::numbers::pi / (2 * T) * std::sin(x);
    // ∫₀ᵗ s = (t + (T/π) sin(πt/T))/2
    const double travelled = T / std::numbers::pi * (x + std::sin(x)) / 2;
    Setpoint c = at_path_time(commands, static_cast<double>(branch) + travelled / kControlPeriod);
    c.a_W = s * s * c.a_W + s_dot * c.v_W;
    c.v_W *= s;
    stopped.push_back(c);
  }
  stopped.back().v_W = stopped.back().a_W = Vec3::Zero();
  return stopped;
}

}  // namespace backwash::plan

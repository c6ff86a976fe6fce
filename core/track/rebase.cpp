// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/rebase.hpp"

#include <algorithm>
#include <cmath>

#include "core/track/frame_alignment.hpp"
#include "core/types/minimum_jerk.hpp"

namespace backwash::track {
namespace {

/// Share β of the shift that is left s ∈ [0, 1] through the way back, and its derivatives by s.
struct Share {
  double value = 1, first = 0, second = 0;
};
Share share_left(double s) noexcept {
  if (s <= 0) return {};
  if (s >= 1) return {0, 0, 0};
  const auto [value, first, second] = minimum_jerk(s);
  return {1 - value, -first, -second};
}

Setpoint blended(const Setpoint& c, const RigidShift& D, const Share& beta, double rate) noexcept {
  const Vec3 off = D.point(c.p_W) - c.p_W, off_v = D.rotate(c.v_W) - c.v_W, off_a = D.rotate(c.a_W) - c.a_W;
  const double b1 = beta.first * rate, b2 = beta.second * rate * rate;
  return {c.p_W + beta.value * off, c.v_W + beta.value * off_v + b1 * off,
          c.a_W + beta.value * off_a + 2 * b1 * off_v + b2 * off, wrap_angle(c.yaw + beta.value * wrap_angle(D.yaw))};
}

std::vector<Setpoint> with_way_back_of(const std::vector<Setpoint>& commands, std::size_t branch, const RigidShift& D,
                                       std::size_t n) {
  std::vector<Setpoint> result;
  const std::size_t size = std::max(commands.size(), branch + n + 1);
  result.reserve(size);
  for (std::size_t k = 0; k < size; ++k) {
    Setpoint c = commands[std::min(k, commands.size() - 1)];
    if (k >= commands.size()) c.v_W = c.a_W = Vec3::Zero();
    const double s = k < branch ? 0 : static_cast<double>(k - branch) / static_cast<double>(n);
    result.push_back(blended(c, D, share_left(s), 1 / (static_cast<double>(n) * kControlPeriod)));
  }
  return result;
}

bool steps_bounded(const std::vector<Setpoint>& commands, const std::vector<Setpoint>& planned, double longest) {
  for (std::size_t k = 1; k < commands.size(); ++k) {
    const double own = k < planned.size() ? (planned[k].p_W - planned[k - 1].p_W).norm() : 0;
    if ((commands[k].p_W - commands[k - 1].p_W).norm() > std::max(longest, own) + 1e-12) return false;
  }
  return true;
}

}  // namespace

Vec3 RigidShift::rotate(const Vec3& v) const noexcept {
  const double c = std::cos(yaw), s = std::sin(yaw);
  return {c * v.x() - s * v.y(), s * v.x() + c * v.y(), v.z()};
}

Setpoint RigidShift::setpoint(const Setpoint& s) const noexcept {
  return {point(s.p_W), rotate(s.v_W), rotate(s.a_W), wrap_angle(s.yaw + yaw)};
}

RigidShift RigidShift::inverse() const noexcept {
  const RigidShift back{-yaw, Vec3::Zero()};
  return {-yaw, -back.rotate(t)};
}

RigidShift operator*(const RigidShift& a, const RigidShift& b) noexcept {
  return {wrap_angle(a.yaw + b.yaw), a.point(b.t)};
}

std::vector<Setpoint> rectified(const std::vector<Setpoint>& commands, std::size_t branch, const RigidShift& D,
                                double v_max, double a_max) {
  if (commands.empty()) return {};
  // The way back alone: the profile's peaks are 15/8 of its mean velocity and 10/√3 of distance/T² of acceleration.
  // Then as long as it takes beside the flight's own motion.
  double farthest = 0;
  for (const Setpoint& c : commands) farthest = std::max(farthest, (D.point(c.p_W) - c.p_W).norm());
  const double least = std::max(15.0 / 8 * farthest / v_max, std::sqrt(10 / std::sqrt(3.0) * farthest / (a_max / 2)));
  auto n = static_cast<std::size_t>(std::max(1.0, std::ceil(least / kControlPeriod)));
  const std::size_t enough = std::max(commands.size(), branch) + 2 * n + 1;
  for (;; n += 1 + n / 8) {
    auto result = with_way_back_of(commands, branch, D, n);
    if (steps_bounded(result, commands, v_max * kControlPeriod)) return result;
    if (n <= enough) continue;
    // Beside a flight at v_max all the way there is no room: rectify at rest, after its end.
    return with_way_back_of(commands, commands.size(), D, n);
  }
}

}  // namespace backwash::track

// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/search/shortcuts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace backwash::plan {
namespace {

constexpr double kSpeedTolerance = 1e-9;   // m/s
constexpr double kLeastPiece = 1e-11;      // s: shorter ones are rounding
constexpr double kSquareRounding = 1e-12;  // m²/s²: in the least time itself the square is zero
constexpr double kLeastShortcut = 0.05;    // s
constexpr double kLeastGain = 1e-3;        // s
constexpr double kWidestShortcut = 8;      // s: what is far apart can hardly be joined directly
constexpr double kTriesPerSecond = 50;
constexpr std::size_t kLeastTries = 300, kMostTries = 3000;

/// One axis for a time: from speed v to a cruising speed c, on to speed w.
struct AxisMotion {
  std::array<double, 3> duration, u;
};

/// Least time to go `d` and change from speed v to w.
double least_time(double d, double v, double w, const AxisLimits& limits) noexcept {
  double best = INFINITY;
  for (const double sign : {1.0, -1.0}) {
    const double way = sign * d, a = sign * v, b = sign * w, A = limits.a_max, V = limits.v_max;
    const double square = A * way + (a * a + b * b) / 2;  // of the speed between
    if (square < 0) continue;
    for (const double peak : {std::sqrt(square), -std::sqrt(square)}) {
      if (peak < std::max(a, b) - kSpeedTolerance) continue;
      const double rest = way - (2 * V * V - a * a - b * b) / (2 * A);  // at full speed
      best = std::min(best, peak <= V ? (2 * peak - a - b) / A : (2 * V - a - b) / A + rest / V);
    }
  }
  return best;
}

/// The same in exactly the time T. The way grows with the cruising speed c: by squares below and above v and w, evenly
/// between.
std::optional<AxisMotion> in_time(double d, double v, double w, const AxisLimits& limits, double T) noexcept {
  const double A = limits.a_max, low = std::min(v, w), high = std::max(v, w), even = T - (high - low) / A;
  if (even < -kLeastPiece) return std::nullopt;
  const double changing = (high * high - low * low) / (2 * A);
  const double at_low = changing + even * low, at_high = changing + even * high;
  double c = low;
  if (d < at_low) {
    const double half = (T * A - v - w) / 2, square = half * half - (v * v + w * w) / 2 + d * A;
    if (square < -kSquareRounding) return std::nullopt;
    c = -half + std::sqrt(std::max(square, 0.0));
  } else if (d > at_high) {
    const double half = (T * A + v + w) / 2, square = half * half - (v * v + w * w) / 2 - d * A;
    if (square < -kSquareRounding) return std::nullopt;
    c = half - std::sqrt(std::max(square, 0.0));
  } else if (even > kLeastPiece) {
    c = low + (d - at_low) / even;
  }
  if (!(std::abs(c) <= limits.v_max + kSpeedTolerance)) return std::nullopt;
  const double first = std::abs(c - v) / A, last = std::abs(w - c) / A, cruise = T - first - last;
  if (cruise < -kLeastPiece) return std::nullopt;
  return AxisMotion{{first, std::max(cruise, 0.0), last}, {c >= v ? A : -A, 0, w >= c ? A : -A}};
}

/// The pieces of three axes together.
std::vector<Motion> merged(const State& from, const std::array<AxisMotion, 3>& axes) {
  std::array<double, 9> ends;
  for (std::size_t axis = 0, n = 0; axis < 3; ++axis)
    for (double t = 0; const double duration : axes[axis].duration) ends[n++] = t += duration;
  std::ranges::sort(ends);
  std::vector<Motion> motions;
  State at = from;
  double begun = 0;
  for (const double end : ends) {
    if (end - begun < kLeastPiece) continue;
    Vec3 u = Vec3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const AxisMotion& m = axes[static_cast<std::size_t>(axis)];
      const double middle = (begun + end) / 2, cruise = m.duration[0] + m.duration[1];
      u[axis] = middle < m.duration[0] ? m.u[0] : middle < cruise ? 0 : middle < cruise + m.duration[2] ? m.u[2] : 0;
    }
    motions.push_back(primitive(at, u, end - begun));
    at = motions.back().end();
    begun = end;
  }
  return motions;
}

bool clear(const SafeView& space, std::span<const Motion> motions) noexcept {
  return std::ranges::all_of(motions, [&](const Motion& m) { return space.clear(m); });
}

/// A piece of a motion.
Motion part(const Motion& m, double from, double to) noexcept {
  return {{m.position(from), m.velocity(from), m.c[2] + 3 * from * m.c[3], m.c[3]}, to - from};
}

double duration_of(std::span<const Motion> motions) noexcept {
  double total = 0;
  for (const Motion& m : motions) total += m.duration;
  return total;
}

/// A time on motions that join.
struct Place {
  std::size_t motion;
  double into;  ///< s
};
Place place_at(std::span<const Motion> motions, double t) noexcept {
  std::size_t n = 0;
  for (; n + 1 < motions.size() && t >= motions[n].duration; ++n) t -= motions[n].duration;
  return {n, std::min(t, motions[n].duration)};
}
State state_at(std::span<const Motion> motions, const Place& p) noexcept {
  return {motions[p.motion].position(p.into), motions[p.motion].velocity(p.into)};
}
/// What lies between two places.
std::vector<Motion> between(std::span<const Motion> motions, const Place& from, const Place& to) {
  std::vector<Motion> parts;
  for (std::size_t n = from.motion; n <= to.motion; ++n) {
    const double begin = n == from.motion ? from.into : 0, end = n == to.motion ? to.into : motions[n].duration;
    if (end - begin > kLeastPiece) parts.push_back(part(motions[n], begin, end));
  }
  return parts;
}

}  // namespace

double cost_of(std::span<const Motion> motions, double rho) noexcept {
  double cost = rho * duration_of(motions);
  for (const Motion& m : motions) cost += m.effort();
  return cost;
}

std::optional<std::vector<Motion>> quickest(const State& from, const State& to, const AxisLimits& limits,
                                            double longest) {
  const double fastest = std::max(from.v_W.cwiseAbs().maxCoeff(), to.v_W.cwiseAbs().maxCoeff());
  if (fastest > limits.v_max + kSpeedTolerance) return std::nullopt;
  const Vec3 d = to.p_W - from.p_W;
  double T = 0;
  for (int axis = 0; axis < 3; ++axis) T = std::max(T, least_time(d[axis], from.v_W[axis], to.v_W[axis], limits));
  for (int slower = 0; slower < 3 && T < longest; ++slower, T *= 1.1) {
    std::array<AxisMotion, 3> axes;
    bool all = true;
    for (int axis = 0; axis < 3 && all; ++axis) {
      const auto found = in_time(d[axis], from.v_W[axis], to.v_W[axis], limits, T);
      if ((all = found.has_value())) axes[static_cast<std::size_t>(axis)] = *found;
    }
    if (!all) continue;
    auto motions = merged(from, axes);
    if (motions.empty() || (motions.back().end().p_W - to.p_W).norm() > 1e-10) return std::nullopt;
    return motions;
  }
  return std::nullopt;
}

std::vector<Motion> along(const SafeView& space, const State& start, std::span<const Vec3> points,
                          const AxisLimits& limits) {
  std::vector<Motion> motions;
  State at = start;
  if (const double speed = start.v_W.cwiseAbs().maxCoeff(); speed > 0) {
    motions.push_back(primitive(start, -start.v_W * (limits.a_max / speed), speed / limits.a_max));
    if (!space.clear(motions.back())) return {};
    at = {motions.back().end().p_W, Vec3::Zero()};
  }
  for (std::size_t reached = 0; reached + 1 < points.size();) {
    for (std::size_t step = points.size() - 1 - reached;; step = (step + 1) / 2) {
      const State to{points[reached + step], Vec3::Zero()};
      const auto leg = quickest(at, to, limits, INFINITY);
      if (leg && clear(space, *leg)) {
        motions.insert(motions.end(), leg->begin(), leg->end());
        reached += step;
        at = to;
        break;
      }
      if (step == 1) return {};
    }
  }
  return motions;
}

std::vector<Motion> shortened(const SafeView& space, std::vector<Motion> motions, const AxisLimits& limits,
                              double rho) {
  double total = duration_of(motions);
  const auto tries = std::clamp(static_cast<std::size_t>(kTriesPerSecond * total), kLeastTries, kMostTries);
  // Roberts' sequence: multiples of 1/g and 1/g², g³ = g + 1, fill the square more evenly than random numbers.
  constexpr double kFirst = 0.7548776662466927, kSecond = 0.5698402909980532;
  double x = 0.5, y = 0.5;
  for (std::size_t n = 0; n < tries; ++n, x += kFirst, x -= std::floor(x), y += kSecond, y -= std::floor(y)) {
    const double wide = std::min(total, kWidestShortcut);
    const double middle = x * total, half = y * wide / 2;
    const double from = std::max(middle - half, 0.0), to = std::min(middle + half, total);
    if (to - from < kLeastShortcut) continue;
    const Place a = place_at(motions, from), b = place_at(motions, to);
    const auto shortcut = quickest(state_at(motions, a), state_at(motions, b), limits, to - from - kLeastGain);
    if (!shortcut || cost_of(*shortcut, rho) >= cost_of(between(motions, a, b), rho) || !clear(space, *shortcut))
      continue;
    std::vector<Motion> next = between(motions, {0, 0}, a);
    next.insert(next.end(), shortcut->begin(), shortcut->end());
    const auto rest = between(motions, b, {motions.size() - 1, motions.back().duration});
    next.insert(next.end(), rest.begin(), rest.end());
    motions = std::move(next);
    total = duration_of(motions);
  }
  return motions;
}

}  // namespace backwash::plan

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <functional>

#include "core/study/effects/effect.hpp"

/// What forms are made of: columns with one value per window.
namespace backwash::study {

inline constexpr std::array<Channel, 3> kVariances = {kVarX, kVarY, kVarZ};

template <typename F>
std::vector<double> values(const Windows& windows, F value) {
  std::vector<double> x;
  x.reserve(windows.size());
  for (const auto& w : windows) x.push_back(value(w));
  return x;
}

template <typename F>
DesignColumn in(Channel channel, const Windows& windows, F value) {
  return {{{channel, values(windows, value)}}};
}

/// A level vector: its x and y in the mean channels.
template <typename F>
DesignColumn level(const Windows& windows, F vector) {
  return {{{kMeanX, values(windows, [&](const WindowRow& w) { return vector(w).x(); })},
           {kMeanY, values(windows, [&](const WindowRow& w) { return vector(w).y(); })}}};
}

/// The same in ln variance along all axes.
template <typename F>
DesignColumn in_variance(const Windows& windows, F value) {
  DesignColumn column;
  for (const Channel c : kVariances) column.parts.push_back({c, values(windows, value)});
  return column;
}

/// Mean of value(place) along the window.
template <typename F>
auto along(const WindowRow& w, F value) {
  if (w.path.empty()) return value(w.around);
  auto sum = value(w.path.front());
  for (std::size_t k = 1; k < w.path.size(); ++k) sum += value(w.path[k]);
  sum /= static_cast<double>(w.path.size());
  return sum;
}

/// A vertical push that varies along the window, value(w, k) at its point k with mean mean(w): where the craft also
/// accelerates by its set-points, what varies looks like a steeper or a later thrust, and is told as its part of those.
template <typename F, typename M>
DesignColumn lifting(const Windows& windows, F value, M mean) {
  const auto moment = [&](const std::array<double, kPoints>& weight, const WindowRow& w) {
    double sum = 0;
    for (std::size_t k = 0; k < kPoints; ++k)
      if (weight[k] != 0) sum += weight[k] * value(w, k);
    return sum;
  };
  return {{{kMeanZ, values(windows, mean)},
           {kThrustDelay, values(windows, [&](auto& w) { return moment(w.delay_at, w); })},
           {kThrustSlope, values(windows, [&](auto& w) { return moment(w.slope_at, w); })}}};
}

/// The same of amount(place).
template <typename F>
DesignColumn lifting(const Windows& windows, F amount) {
  return lifting(
      windows, [&](auto& w, std::size_t k) { return w.path.empty() ? 0.0 : amount(w.path[k]); },
      [&](auto& w) { return along(w, amount); });
}

/// Σ amount(d) over walls, towards each.
template <typename F>
Vec3 towards(const std::vector<std::pair<double, Vec3>>& walls, F amount) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [distance, direction] : walls) sum += amount(distance) * direction;
  return sum;
}

/// Functions for Form::columns of one column, by the scale too: value(window, scale) in one channel, and in ln variance
/// along all axes; amount(place, scale) that lifts along the window.
template <typename F>
auto shows(Channel channel, F value) {
  return [=](const Windows& ws, const Scale& scale) {
    return std::vector{in(channel, ws, [&](auto& w) { return value(w, scale); })};
  };
}
template <typename F>
auto scatters(F value) {
  return [=](const Windows& ws, const Scale& scale) {
    return std::vector{in_variance(ws, [&](auto& w) { return value(w, scale); })};
  };
}
template <typename F>
auto lifts(F amount) {
  return [=](const Windows& ws, const Scale& scale) {
    return std::vector{lifting(ws, [&](auto& at) { return amount(at, scale.value); })};
  };
}

/// (reference/distance)^n, nowhere nearer than near_surface() goes; 0 where there is no surface.
double power_of_distance(double distance, double reference, double n);

/// A vector of the body, growing with `amount`, in all mean channels.
std::vector<DesignColumn> body_drift(const Windows& windows, const std::function<double(const WindowRow&)>& amount);

/// −x T/m: a share of the thrust that is missing, seen in the mean and in what a change of the command is worth.
DesignColumn missing_thrust(const Windows& windows, const std::function<double(const WindowRow&)>& share);

/// The same of a share m that is missing everywhere, and aside what it takes off the accelerations that the set-points
/// ask for: their mean, and what their course along a window adds to the variance there.
DesignColumn missing_thrust(const Windows& windows, double m);

/// An offset to whole millimetres, level.
Vec3 whole_millimetres(const Vec3& offset_W);
/// ln Σ with the map moved by an offset, less that as it is.
std::vector<DesignColumn> displaced(const Windows& windows, const Vec3& offset_W);

/// The numbers of the rotors, from 0.
std::vector<Scale> rotors();
/// 1 in the channel of one of four rotors, from `first` on; contrast: less the mean of the four.
DesignColumn one_rotor(Channel first, const Windows& windows, const Scale& rotor, bool contrast);

/// e^x − 1: of what was fitted to a logarithm.
inline double share_of_ln(double x) { return std::expm1(x); }
inline double as_fitted(double x) { return x; }

/// Whether any window passes a test.
template <typename F>
bool any(const Observations& seen, F test) {
  for (const auto& w : seen.windows)
    if (test(w)) return true;
  return false;
}

}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "core/study/effects/catalogue.hpp"

namespace backwash::study {

/// The catalogue's rows, by what they are about.
std::vector<Form> surface_forms();   ///< floor, ceiling, walls
std::vector<Form> vehicle_forms();   ///< thrust, mass, delays, speed
std::vector<Form> push_forms();      ///< fixed to the body or the world
std::vector<Form> variance_forms();  ///< of the disturbance and its tail
std::vector<Form> rotor_forms();     ///< single rotors

/// Other shapes of an effect's form, in the literature as good as its own: the same parameters, at the same reference.
/// They take no part in the search; estimates are averaged over them (estimate.hpp).
std::vector<Form> shapes_of(const Form& form);

/// What columns are built of: one value per window in one channel, in both level means, in ln variance along all axes.
inline constexpr std::array<Channel, 3> kVariances = {kVarX, kVarY, kVarZ};

template <typename F>
std::vector<double> values(const Windows& windows, F value) {
  std::vector<double> x;
  x.reserve(windows.size());
  for (const auto& w : windows) x.push_back(value(w));
  return x;
}

template <typename F>
Column in(Channel channel, const Windows& windows, F value) {
  return {{{channel, values(windows, value)}}};
}

/// A level vector: its x and y in the mean channels.
template <typename F>
Column level(const Windows& windows, F vector) {
  return {{{kMeanX, values(windows, [&](const WindowRow& w) { return vector(w).x(); })},
           {kMeanY, values(windows, [&](const WindowRow& w) { return vector(w).y(); })}}};
}

/// The same in ln variance along all axes.
template <typename F>
Column in_variance(const Windows& windows, F value) {
  Column column;
  for (const Channel c : kVariances) column.parts.push_back({c, values(windows, value)});
  return column;
}

/// A level offset of the map, m (less than 0.5 along each axis), as one number, the scale of its form: millimetres +
/// 500 along x, times 1,000, and along y.
double offset_code(const Vec3& offset_W);
Vec3 map_offset(double code);

/// Mean of value(place) along the window.
template <typename F>
auto along(const WindowRow& w, F value) {
  if (w.path.empty()) return value(w.around);
  auto sum = value(w.path.front());
  for (std::size_t k = 1; k < w.path.size(); ++k) sum += value(w.path[k]);
  sum /= static_cast<double>(w.path.size());
  return sum;
}

/// Σ amount(d) over walls, towards each.
template <typename F>
Vec3 towards(const std::vector<std::pair<double, Vec3>>& walls, F amount) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [distance, direction] : walls) sum += amount(distance) * direction;
  return sum;
}

/// A vector of the body, growing with `amount`, in all mean channels.
std::vector<Column> body_drift(const Windows& windows, const std::function<double(const WindowRow&)>& amount);

/// −x T/m: a share of the thrust that is missing, seen in the mean and in what a change of the command is worth.
Column missing_thrust(const Windows& windows, const std::function<double(const WindowRow&)>& share);

}  // namespace backwash::study

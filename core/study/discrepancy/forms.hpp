// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "core/study/discrepancy/catalogue.hpp"

namespace backwash::study::discrepancy {

/// The catalogue's rows, by what they are about.
std::vector<Form> surface_forms();   ///< floor, ceiling, walls
std::vector<Form> vehicle_forms();   ///< thrust, mass, delays, speed
std::vector<Form> push_forms();      ///< fixed to the body or the world
std::vector<Form> variance_forms();  ///< of the disturbance and its tail
std::vector<Form> rotor_forms();     ///< single rotors

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

/// −x T/m: a share of the thrust that is missing, seen in the mean and in what a change of the command is worth.
Column missing_thrust(const Windows& windows, const std::function<double(const WindowRow&)>& share);

}  // namespace backwash::study::discrepancy

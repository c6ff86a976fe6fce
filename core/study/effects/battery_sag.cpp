// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {
namespace {

/// The thrust is as modelled at the highest voltage flown; relative to the mean one.
std::vector<Column> sagging(const Windows& ws, const Scale&) {
  double highest = 0, mean = 1e-6;
  for (const auto& w : ws) highest = std::max(highest, w.voltage), mean += w.voltage / ws.size();
  return {missing_thrust(ws, [&](auto& w) { return (highest - w.voltage) / mean; })};
}

}  // namespace

/// A lower voltage gives less thrust for the same command.
Effect battery_sag() {
  return {.name = "battery_sag",
          .forms = {{.formula = "thrust (1 - s (V0 - V)/Vm), V0 the highest and Vm the mean voltage flown",
                     .parameters = {"s"},
                     .floor = 0.01,
                     .needs = {Source::battery, Source::thrust},
                     .columns = sagging,
                     .companions =
                         [](const Windows& ws) { return std::vector{missing_thrust(ws, [](auto&) { return 1.0; })}; },
                     .extend = flown_range}},
          .axis = {"battery, V", false, [](auto& w) { return w.voltage; }},
          .manoeuvres = {{"hover on a fresh battery and on a used one, the same spot and time of flight",
                          [](WindowRow& w, double s) {
                            w.voltage *= s < 0.5 ? 1.0 : 0.9;
                            w.t = 30;
                          }}}};
}

}  // namespace backwash::study

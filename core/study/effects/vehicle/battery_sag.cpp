// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "core/study/effects/columns.hpp"
#include "core/study/effects/effect_rules.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {
namespace {

/// The highest and the mean voltage flown.
std::vector<double> voltages(const Windows& ws) {
  double highest = 0, mean = kEffectRules.no_sag;
  for (const auto& w : ws) {
    highest = std::max(highest, w.voltage);
    mean += w.voltage / static_cast<double>(ws.size());
  }
  return {highest, mean};
}

/// Relative to the mean voltage; that the thrust is as modelled at the highest one is the companion's to correct.
std::vector<DesignColumn> sagging(const Windows& ws, const Scale& scale) {
  const auto anchor = scale.anchor.size() == 2 ? scale.anchor : voltages(ws);
  return {missing_thrust(ws, [&](auto& w) { return (anchor[0] - w.voltage) / anchor[1]; })};
}

/// The columns are of the thrust commanded on the mean, which is 1/F of what is flown at Vm: F = 1 − c − s (V0 −
/// Vm)/Vm. As a factor on the commanded thrust, which changes with it, that is s F per Vm, and 1 at the voltage V*.
std::vector<SimulationTerm> by_voltage(const FittedForm& fitted, const Observations& seen) {
  const auto anchor = fitted.scale.anchor.size() == 2 ? fitted.scale.anchor : voltages(seen.windows);
  const double s = fitted.theta[0], c = fitted.beside.empty() ? 0 : fitted.beside[0];
  const double at_mean = 1 - c - s * (anchor[0] - anchor[1]) / anchor[1], slope = s * at_mean;
  const double full = anchor[1] + (std::abs(slope) > kEffectRules.no_sag ? (1 - at_mean) * anchor[1] / slope : 0);
  const Course course = mean_course(seen, &WindowRow::voltage);
  return {{SimulationTerm::Kind::thrust_with_voltage, {slope, full, anchor[1], course.first, course.rate}}};
}

}  // namespace

/// A lower voltage gives less thrust for the same command.
Effect battery_sag() {
  return {.name = "battery_sag",
          .forms = {{.formula = "thrust (1 - s (V0 - V)/Vm), V0 the highest and Vm the mean voltage flown",
                     .parameters = {"s"},
                     .priors = {{kPriors.typical_power}},
                     .floor = 0.01,
                     .needs = {Source::battery, Source::thrust},
                     .columns = sagging,
                     .companions =
                         [](const Windows& ws) { return std::vector{missing_thrust(ws, [](auto&) { return 1.0; })}; },
                     .anchor = voltages,
                     .extend = flown_range,
                     .simulate = by_voltage}},
          .axis = {"battery, V", false, [](auto& w) { return w.voltage; }},
          .remedy =
              [](auto&, auto&) {
                return with_craft(
                    "Switch on the autopilot's compensation of the battery's voltage, or land before it has sagged.");
              },
          .manoeuvres = {{"hover on a fresh battery and on a used one, the same spot and time of flight",
                          [](WindowRow& w, double s) {
                            w.voltage *= s < 0.5 ? 1.0 : 0.9;
                            w.t = 30;
                          }}}};
}

}  // namespace backwash::study

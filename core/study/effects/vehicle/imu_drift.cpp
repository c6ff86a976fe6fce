// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {
namespace {

/// The bias with which a drift begins.
std::vector<DesignColumn> first_bias(const Windows& ws) {
  return {level(ws, [](auto& w) -> Vec3 { return w.body_axis(0); }),
          level(ws, [](auto& w) -> Vec3 { return w.body_axis(1); }), in(kMeanZ, ws, [](auto&) { return 1.0; })};
}

using Kind = SimulationTerm::Kind;

/// The drift and the bias with which it begins.
SimulationTerm drift(Kind kind, const FittedForm& fitted) {
  SimulationTerm term{kind, {fitted.theta.begin(), fitted.theta.end()}};
  term.value.resize(6, 0);
  for (std::size_t i = 0; i < fitted.beside.size(); ++i) term.value[3 + i] = fitted.beside[i];
  return term;
}

Form with_time() {
  return {.formula = "accelerometer bias b t/100 s, fixed to the body",
          .parameters = {"x_mps2_per_100s", "y_mps2_per_100s", "z_mps2_per_100s"},
          .priors = {{kPriors.typical_push}, {kPriors.typical_push}, {kPriors.typical_push}},
          .reference = Reference{100, "s", [](auto& w) { return w.t; }},
          .in_sensor = true,
          .floor = 0.015,
          .needs = {Source::attitude},
          .columns = [](const Windows& ws, const Scale&) { return body_drift(ws, [](auto& w) { return w.t / 100; }); },
          .companions = first_bias,
          .shapes = {{.formula = "accelerometer bias b (t/100 s)^n, fixed to the body",
                      .parameters = {},
                      .scale_name = "n",
                      .scales = scales_of({0.75, 4.0 / 3}),
                      .columns =
                          [](const Windows& ws, const Scale& n) {
                            return body_drift(ws, [&](auto& w) { return std::pow(std::max(w.t, 0.0) / 100, n.value); });
                          }}},
          .extend = unknown_push,
          .simulate = [](const FittedForm& fitted,
                         const Observations&) { return std::vector{drift(Kind::sensor_drift_with_time, fitted)}; }};
}

Form with_temperature() {
  return {.formula = "accelerometer bias b (T - 25 C)/10 C, fixed to the body",
          .parameters = {"x_mps2_per_10c", "y_mps2_per_10c", "z_mps2_per_10c"},
          .priors = {{kPriors.typical_push}, {kPriors.typical_push}, {kPriors.typical_push}},
          .reference = Reference{25, "C", [](auto& w) { return w.temperature; }},
          .in_sensor = true,
          .floor = 0.015,
          .needs = {Source::temperature, Source::attitude},
          .columns = [](const Windows& ws,
                        const Scale&) { return body_drift(ws, [](auto& w) { return (w.temperature - 25) / 10; }); },
          .companions = first_bias,
          .extend = unknown_push,
          .simulate =
              [](const FittedForm& fitted, const Observations& seen) {
                auto term = drift(Kind::sensor_drift_with_temperature, fitted);
                const Course course = mean_course(seen, &WindowRow::temperature);
                term.value.insert(term.value.end(), {course.first, course.rate});
                return std::vector{term};
              }};
}

}  // namespace

/// The accelerometer's bias wanders with the time of flight or with its temperature.
Effect imu_drift() {
  return {.name = "imu_drift",
          .forms = {with_time(), with_temperature()},
          .remedy = always(RemedyIn::craft,
                           "Calibrate the accelerometer over its temperature, or let it warm up before take-off."),
          .manoeuvres = {{"start warm and start cold, the same spot and battery", [](WindowRow& w, double s) {
                            w.temperature += s < 0.5 ? 0.0 : 12.0;
                            w.t = 30;
                          }}}};
}

}  // namespace backwash::study

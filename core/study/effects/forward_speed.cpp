// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {
namespace {

/// Mean of the power, not the power of the mean: a window holds a start or a stop.
double speed_power(const WindowRow& w, double power) {
  double sum = 0;
  for (const double v : w.speeds) sum += std::pow(v, power) / kPoints;
  return sum;
}

/// Mean of share(v) where the gusts are: a window that climbs away from the floor has most of its variance while it is
/// slow.
template <typename F>
double of_gusts(const WindowRow& w, F share) {
  double sum = 0;
  for (std::size_t k = 0; k < kPoints; ++k) sum += w.shares[k] * share(w.speeds[k]);
  return sum;
}

double to_power(const WindowRow& w, double n) {
  return of_gusts(w, [&](double v) { return std::pow(v, n); });
}

/// ln of variances that add, 1 + (v/knee)², over its value at 1 m/s.
double added(const WindowRow& w, double knee) {
  return of_gusts(w, [&](double v) { return std::log1p(std::pow(v / knee, 2)); }) / std::log1p(1 / (knee * knee));
}

const Reference pace = {1, "m/s", [](auto& w) { return w.speed; }};

}  // namespace

/// Thrust and gusts change with the speed.
Effect forward_speed() {
  return {
      .name = "forward_speed",
      .forms = {{.formula = "z push C (v/1 m/s)^2",
                 .parameters = {"C_mps2"},
                 .possible = {{-3, 3, "a push of 3 m/s² is 30 % of the weight, at a walking pace"}},
                 .reference = pace,
                 .floor = 0.02,
                 .columns =
                     [](const Windows& ws, const Scale&) {
                       return std::vector{in(kMeanZ, ws, [](auto& w) { return speed_power(w, 2); })};
                     },
                 .extend = extends(Law::push_with_speed),
                 .simulate = simulates(Law::push_with_speed)},
                {.formula = "ln variance + B (v/1 m/s)^n",
                 .parameters = {"B_ln"},
                 .possible = {{-4, 4, "gusts of e^4, 55 times, the modelled variance are another model"}},
                 .reference = pace,
                 .scale_name = "n",
                 .scales = scales_of({1, 2}),
                 .floor = 0.12,
                 .columns =
                     [](const Windows& ws, const Scale& n) {
                       return std::vector{in_variance(ws, [&](auto& w) { return to_power(w, n.value); })};
                     },
                 .shapes = {{.formula = "ln variance + B ln(1 + (v/u)^2)/ln(1 + (1 m/s/u)^2): gusts that add",
                             .parameters = {},
                             .scale_name = "u_mps",
                             .scales = scales_of({0.5, 1, 2}),
                             .columns =
                                 [](const Windows& ws, const Scale& knee) {
                                   return std::vector{in_variance(ws, [&](auto& w) { return added(w, knee.value); })};
                                 }}},
                 .extend = extends(Law::ln_variance_with_speed),
                 .simulate = simulates(Law::ln_variance_with_speed)}},
      .axis = {"speed, m/s", false, [](auto& w) { return w.speed; }},
      .manoeuvres = {{"fly fast and slow on one line at one height", [](WindowRow& w, double s) {
                        w.speed = 1.5 * s, w.speeds.fill(w.speed);
                        w.v_W = w.speed * (std::fmod(8 * s, 2.0) < 1 ? Vec3(Vec3::UnitX()) : Vec3(-Vec3::UnitX()));
                      }}}};
}

}  // namespace backwash::study

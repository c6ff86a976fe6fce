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

/// What gusts add to the square of the speed, (m/s)²: of a critically damped loop Σ τ_w/(2 √k_p) along each axis. Of
/// the modelled Σ: what is measured answers the gusts.
/// None where the speed is measured, and has them in it.
double sway2(const WindowRow& w) { return w.led ? kWindowRules.tau_w * w.sigma.dot(w.led->give.cwiseSqrt()) / 2 : 0; }

/// What is left of the gusts at a place along a window, a share of its length from the middle, when mean and trend are
/// taken out: 1 − (1 + 12 u²) 2τ_w/T, as far as their correlation lies within the window.
double left_of_trend(const WindowRow& w, double u) {
  const double tau = kWindowRules.tau_w / w.duration;
  const double within = 1 - (std::exp((u - 0.5) / tau) + std::exp((-u - 0.5) / tau)) / 2;
  return std::max(0.0, 1 - (1 + 12 * u * u) * 2 * tau * within);
}

/// Of what goes with the speed as B share(v), the ln of the mean factor e^{B share} along a window, over B: a window
/// holds a start or a stop, and what is measured is the ln of its variance. Places count by the modelled variance that
/// they have. B is scale.anchor; without it, the mean of share.
template <typename F>
double of_gusts(const WindowRow& w, const Scale& scale, F share) {
  const double size = scale.anchor.empty() ? 0 : scale.anchor[0], sway = sway2(w);
  std::array<double, kPoints> at, weight;
  double total = 0, mean = 0, factor = 0;
  for (std::size_t k = 0; k < kPoints; ++k) {
    at[k] = share(std::sqrt(w.speeds[k] * w.speeds[k] + sway));
    weight[k] = w.shares[k] * left_of_trend(w, (static_cast<double>(k) + 0.5) / kPoints - 0.5);
    total += weight[k];
    mean += weight[k] * at[k];
  }
  if (!(total > 0)) return 0;
  mean /= total;
  for (std::size_t k = 0; k < kPoints; ++k) factor += weight[k] / total * std::expm1(size * (at[k] - mean));
  return size != 0 && std::isfinite(factor) ? mean + std::log1p(factor) / size : mean;
}

double to_power(const WindowRow& w, const Scale& n) {
  return of_gusts(w, n, [&](double v) { return std::pow(v, n.value); });
}

/// ln of variances that add, 1 + (v/knee)², over its value at 1 m/s.
double gusts_that_add(const WindowRow& w, const Scale& knee) {
  const double at_pace = std::log1p(1 / (knee.value * knee.value));
  return of_gusts(w, knee, [&](double v) { return std::log1p(std::pow(v / knee.value, 2)) / at_pace; });
}

const Reference pace = {1, "m/s", [](auto& w) { return w.speed; }};

}  // namespace

/// Thrust and gusts change with the speed.
Effect forward_speed() {
  return {.name = "forward_speed",
          .forms = {{.formula = "z push C (v/1 m/s)^2",
                     .parameters = {"C_mps2"},
                     .priors = {{kPriors.typical_push}},
                     .reference = pace,
                     .floor = 0.02,
                     .columns = shows(kMeanZ, [](auto& w, auto&) { return speed_power(w, 2); }),
                     .extend = extends(Law::push_with_speed),
                     .simulate = simulates(Law::push_with_speed)},
                    {.formula = "ln variance + B (v/1 m/s)^n",
                     .parameters = {"B_ln"},
                     .priors = {{kPriors.typical_ln}},
                     .reference = pace,
                     .scale_name = "n",
                     .scales = scales_of({1, 2}),
                     .by_size = true,
                     .floor = 0.12,
                     .columns = scatters(to_power),
                     .shapes = {{.formula = "ln variance + B ln(1 + (v/u)^2)/ln(1 + (1 m/s/u)^2): gusts that add",
                                 .parameters = {},
                                 .scale_name = "u_mps",
                                 .scales = scales_of({0.5, 1, 2}),
                                 .columns = scatters(gusts_that_add)}},
                     .extend = extends(Law::ln_variance_with_speed),
                     .simulate = simulates(Law::ln_variance_with_speed)}},
          .axis = {"speed, m/s", false, [](auto& w) { return w.speed; }},
          .manoeuvres = {{"fly fast and slow on one line at one height", [](WindowRow& w, double s) {
                            w.speed = 1.5 * s;
                            w.speeds.fill(w.speed);
                            w.v_W = w.speed * (std::fmod(8 * s, 2.0) < 1 ? Vec3(Vec3::UnitX()) : Vec3(-Vec3::UnitX()));
                          }}}};
}

}  // namespace backwash::study

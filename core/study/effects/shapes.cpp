// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "core/field/extension.hpp"
#include "core/study/effects/forms.hpp"

namespace backwash::study {
namespace {

constexpr double kNearest = 0.15;  // m: as in near_surface
/// Ends of the grids of exponents, less the factor 1.5 that the estimate adds.
const std::vector<double> kOfDistance = {1.0, 3.0}, kOfTime = {0.75, 4.0 / 3};

double power_of(double distance, double reference, double n) {
  return std::isfinite(distance) ? std::pow(reference / std::max(distance, kNearest), n) : 0.0;
}

Form like(const Form& form, const std::string& formula, const std::vector<double>& scales,
          std::function<std::vector<Column>(const Windows&, double)> columns) {
  return {.cause = form.cause,
          .formula = formula,
          .parameters = form.parameters,
          .scale_name = "n",
          .scales = scales,
          .columns = std::move(columns)};
}

}  // namespace

std::vector<Form> shapes_of(const Form& form) {
  const auto is = [&](const char* cause, const char* parameter) {
    return form.cause == cause && form.parameters.front() == parameter;
  };
  using field::near_surface, field::kSurfaceReference, field::kCeilingReference;
  if (is("ground_thrust", "A_mps2"))
    return {like(form, "z push A (0.4 m/h)^n", kOfDistance, [](const Windows& ws, double n) {
      return std::vector{in(kMeanZ, ws, [&](auto& w) {
        return along(w, [&](auto& at) { return power_of(at.height, kSurfaceReference, n); });
      })};
    })};
  if (is("ceiling", "A_mps2"))
    return {like(form, "z push A (0.3 m/d)^n", kOfDistance, [](const Windows& ws, double n) {
      return std::vector{in(kMeanZ, ws, [&](auto& w) {
        return along(w, [&](auto& at) { return power_of(at.ceiling_gap, kCeilingReference, n); });
      })};
    })};
  if (is("wall_attraction", "A_mps2")) {
    const auto pull = [](bool whole, auto amount) {
      return [whole, amount](const Windows& ws, double scale) {
        return std::vector{level(ws, [&](auto& w) {
          return along(w, [&](auto& at) {
            return towards(whole ? at.whole_walls : at.walls, [&](double d) { return amount(d, scale); });
          });
        })};
      };
    };
    const auto exponential = [](double d, double length) { return near_surface(d, kSurfaceReference, length); };
    const auto power = [](double d, double n) { return power_of(d, kSurfaceReference, n); };
    return {like(form, "push A (0.4 m/d)^n towards each wall", kOfDistance, pull(false, power)),
            like(form, form.formula + ", from floor to ceiling alone", form.scales, pull(true, exponential)),
            like(form, "push A (0.4 m/d)^n towards walls from floor to ceiling", kOfDistance, pull(true, power))};
  }
  if (is("imu_drift", "x_mps2_per_100s"))
    return {like(form, "accelerometer bias b (t/100 s)^n, fixed to the body", kOfTime, [](const Windows& ws, double n) {
      return body_drift(ws, [n](auto& w) { return std::pow(std::max(w.t, 0.0) / 100, n); });
    })};
  return {};
}

}  // namespace backwash::study

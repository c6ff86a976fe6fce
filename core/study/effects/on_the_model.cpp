// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/on_the_model.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::study {

double half_width(const Estimate& e) { return std::max(0.0, (e.high - e.low) / 2); }

std::vector<double> added(const FittedForm& fitted, const Observations& seen, Channel channel) {
  std::vector<double> sum;
  each_value(fitted.columns, fitted.theta, [&](Channel c, std::size_t i, double x) {
    if (c != channel) return;
    sum.resize(seen.windows.size(), 0);
    sum[i] += x;
  });
  return sum;
}

std::vector<ModelEffect> own_fit(Law kind, const FittedForm& fitted) {
  const Estimate& e = fitted.parameters.front();
  const double value = fitted.theta[0], error = std::max({0.0, e.high - value, value - e.low});
  return {{kind, Vec3(value, 0, 0), Vec3(error, 0, 0), fitted.scale.value}};
}

std::function<std::vector<ModelEffect>(const FittedForm&, const Observations&)> extends(Law kind) {
  return [kind](const FittedForm& fitted, const Observations&) { return own_fit(kind, fitted); };
}

std::vector<ModelEffect> unknown_push(const FittedForm& fitted, const Observations& seen) {
  const auto x = added(fitted, seen, kMeanX), y = added(fitted, seen, kMeanY), z = added(fitted, seen, kMeanZ);
  ModelEffect e{Law::push, Vec3::Zero(), Vec3::Zero(), 0};
  for (std::size_t i = 0; i < seen.windows.size(); ++i) {
    e.error.x() = std::max(e.error.x(), std::hypot(x.empty() ? 0 : x[i], y.empty() ? 0 : y[i]));
    e.error.z() = std::max(e.error.z(), z.empty() ? 0 : std::abs(z[i]));
  }
  const Estimate& first = fitted.parameters.front();
  const double size = std::abs(first.value);
  if (size > 0) e.error *= 1 + half_width(first) / size;
  return {e};
}

std::vector<ModelEffect> flown_range(const FittedForm& fitted, const Observations& seen) {
  auto z = added(fitted, seen, kMeanZ);
  if (fitted.form.companions && !fitted.beside.empty()) {
    auto open = fitted.form.companions(seen.windows);
    open.resize(std::min(open.size(), fitted.beside.size()));
    each_value(open, fitted.beside, [&](Channel c, std::size_t i, double x) { z[i] += c == kMeanZ ? x : 0; });
  }
  const auto [low, high] = std::minmax_element(z.begin(), z.end());
  const Estimate& first = fitted.parameters.front();
  const double size = std::abs(first.value), most = std::max(std::abs(*low), std::abs(*high));
  return {{Law::push, Vec3(0, 0, (*low + *high) / 2),
           Vec3(0, 0, (*high - *low) / 2 + (size > 0 ? most * half_width(first) / size : 0)), 0}};
}

std::function<std::vector<SimulationTerm>(const FittedForm&, const Observations&)> simulates(
    std::variant<Law, SimulationTerm::Kind> kind) {
  return [kind](const FittedForm& fitted, const Observations&) {
    SimulationTerm term{kind, {fitted.theta.begin(), fitted.theta.end()}};
    if (!fitted.form.scale_name.empty()) term.value.push_back(fitted.scale.value);
    return std::vector{term};
  };
}

SimulationTerm rotor_lines(const Observations& seen) {
  SimulationTerm term{SimulationTerm::Kind::sensor_lines, std::vector<double>(5, 0)};
  double floor = 0, of_floor = 0;
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    double power = 0, n = 0;
    for (const auto& w : seen.windows) {
      const auto& line = w.lines[rotor];
      if (line) {
        power += line->amplitude2;
        floor += line->floor2;
        n += 1;
        of_floor += 1;
      }
    }
    if (n > 0) term.value[rotor] = std::sqrt(std::max(0.0, power / n));
  }
  if (of_floor > 0) term.value[4] = std::sqrt(std::max(0.0, floor / of_floor));
  return term;
}

Course mean_course(const Observations& seen, double WindowRow::*quantity) {
  double n = 0, t = 0, x = 0, tt = 0, tx = 0;
  for (const auto& w : seen.windows) {
    n += 1;
    t += w.t;
    x += w.*quantity;
    tt += w.t * w.t;
    tx += w.t * (w.*quantity);
  }
  const double spread = n * tt - t * t;
  const double rate = spread > 0 ? (n * tx - t * x) / spread : 0;
  return {n > 0 ? (x - rate * t) / n : 0, rate};
}

}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/on_the_model.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::study {

using Kind = ModelEffect::Kind;

double half_width(const Estimate& e) { return std::max(0.0, (e.high - e.low) / 2); }

std::vector<double> added(const FittedForm& fitted, const Observations& seen, Channel channel) {
  std::vector<double> sum;
  for (std::size_t k = 0; k < fitted.columns.size(); ++k)
    for (const auto& part : fitted.columns[k].parts) {
      if (part.channel != channel) continue;
      sum.resize(seen.windows.size(), 0);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += fitted.theta[k] * part.x[i];
    }
  return sum;
}

std::vector<ModelEffect> own_fit(Kind kind, const FittedForm& fitted) {
  const Estimate& e = fitted.parameters.front();
  const double value = fitted.theta[0], error = std::max({0.0, e.high - value, value - e.low});
  return {{kind, Vec3(value, 0, 0), Vec3(error, 0, 0), fitted.scale.value}};
}

std::function<std::vector<ModelEffect>(const FittedForm&, const Observations&)> extends(Kind kind) {
  return [kind](const FittedForm& fitted, const Observations&) { return own_fit(kind, fitted); };
}

std::vector<ModelEffect> unknown_push(const FittedForm& fitted, const Observations& seen) {
  const auto x = added(fitted, seen, kMeanX), y = added(fitted, seen, kMeanY), z = added(fitted, seen, kMeanZ);
  ModelEffect e{Kind::push, Vec3::Zero(), Vec3::Zero(), 0};
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
  const auto z = added(fitted, seen, kMeanZ);
  const auto [low, high] = std::minmax_element(z.begin(), z.end());
  const Estimate& first = fitted.parameters.front();
  const double size = std::abs(first.value), most = std::max(std::abs(*low), std::abs(*high));
  return {{Kind::push, Vec3(0, 0, (*low + *high) / 2),
           Vec3(0, 0, (*high - *low) / 2 + (size > 0 ? most * half_width(first) / size : 0)), 0}};
}

}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/signals/texture.hpp"

#include <algorithm>
#include <cmath>

#include "core/study/windows/gates/window_rules.hpp"

namespace backwash::study {
namespace {

/// Mean of x_i x_{i+lag}.
double shared(const std::vector<double>& x, std::size_t lag) {
  if (x.size() <= lag) return 0;
  double sum = 0;
  for (std::size_t i = lag; i < x.size(); ++i) sum += x[i] * x[i - lag];
  return sum / static_cast<double>(x.size() - lag);
}

double white_part(double c0, double c1, double c2) {
  return c1 > c2 && c2 > 0 ? std::clamp(c0 - c1 * c1 / c2, 0.0, c0) : 0.0;
}

}  // namespace

Texture texture_of(const std::vector<Residual>& windows, double rate_hz) {
  Texture t;
  std::size_t shortest = SIZE_MAX;
  for (const auto& w : windows)
    if (w.comparable) shortest = std::min(shortest, w.x[0].size());
  for (double seconds = kWindowRules.noise_near; seconds <= kWindowRules.window_length / 2;
       seconds += kWindowRules.noise_between) {
    const auto lag = static_cast<std::size_t>(std::lround(seconds * rate_hz));
    if (lag > 2 && lag + static_cast<std::size_t>(kWindowRules.noise_overlap) < shortest &&
        (t.lags.empty() || lag > t.lags.back()))
      t.lags.push_back(lag);
  }
  t.correlation.assign(t.lags.size(), 0);
  double total = 0, count = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::array<double, 3> c{};
    double weight = 0;
    for (const auto& w : windows) {
      if (!w.comparable) continue;
      const auto& x = w.x[static_cast<std::size_t>(axis)];
      for (std::size_t k = 0; k < 3; ++k) c[k] += shared(x, k) / w.sigma[axis];
      for (std::size_t k = 0; k < t.lags.size(); ++k) t.correlation[k] += shared(x, t.lags[k]) / w.sigma[axis];
      weight += 1 / w.sigma[axis];
      count += 1;
    }
    const double white = white_part(c[0], c[1], c[2]);
    if (weight > 0) t.white[axis] = white / weight;
    total += c[0] - white;
  }
  if (!(total > 0)) return t;
  t.scale = total / count;
  for (double& r : t.correlation) r /= total;
  return t;
}

Fourth fourth_moments(const Residual& window, const Texture& t) {
  Fourth sum;
  if (t.lags.empty()) return sum;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto& x = window.x[static_cast<std::size_t>(axis)];
    const double white = t.white[axis], unit = std::pow(t.scale * window.sigma[axis], 2);
    double fourth = 0;
    std::vector<double> square;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double v2 = x[i] * x[i], share = window.share.empty() ? 1 : window.share[i];
      fourth += (v2 * (v2 - 6 * white) + 3 * white * white) / (share * share);
      square.push_back((v2 - white) / share);
    }
    sum.at_once += fourth / (3 * static_cast<double>(x.size()) * unit * 3);
    for (std::size_t k = 0; k < t.lags.size(); ++k)
      sum.apart += shared(square, t.lags[k]) / (1 + 2 * t.correlation[k] * t.correlation[k]) /
                   (static_cast<double>(t.lags.size()) * unit * 3);
  }
  return sum;
}

std::vector<double> tails(const std::vector<Fourth>& windows) {
  Fourth mean;
  const double n = static_cast<double>(windows.size());
  for (const auto& w : windows) {
    mean.at_once += w.at_once / n;
    mean.apart += w.apart / n;
  }
  if (!(mean.at_once > 0) || !(mean.apart > 0)) return {};
  std::vector<double> y;
  y.reserve(windows.size());
  for (const auto& w : windows)
    y.push_back(std::log(mean.at_once / mean.apart) + w.at_once / mean.at_once - w.apart / mean.apart);
  return y;
}

}  // namespace backwash::study

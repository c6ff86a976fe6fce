// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/signals/gust_spectrum.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace backwash::study {
namespace {

/// The exponent p of each shape, and τ/T = √π Γ(p)/Γ(p − ½).
struct Shape {
  double p;
  double tau_over_T() const { return std::sqrt(std::numbers::pi) * std::tgamma(p) / std::tgamma(p - 0.5); }
};
constexpr std::array<Shape, kGustShapes> kShapes{{{5.0 / 6}, {1}, {2}}};

/// Power of the tapered signal at the k-th frequency of the stretch, up to a factor common to all.
double power(const std::vector<double>& tapered, std::size_t k) {
  const std::complex<double> turn =
      std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(tapered.size()));
  std::complex<double> sum = 0, at = 1;
  for (const double x : tapered) {
    sum += x * at;
    at *= turn;
  }
  return std::norm(sum);
}

std::vector<double> hann_tapered(const std::vector<double>& x) {
  const double n = static_cast<double>(x.size());
  double mean = 0;
  for (const double value : x) mean += value / n;
  std::vector<double> out;
  for (std::size_t k = 0; k < x.size(); ++k)
    out.push_back((x[k] - mean) * (1 - std::cos(2 * std::numbers::pi * (static_cast<double>(k) + 0.5) / n)));
  return out;
}

/// What a stretch tells: omega (rad/s) and one periodogram per axis (columns), |H|² divided out.
struct Periodograms {
  Eigen::ArrayXd omega;
  Eigen::ArrayXXd of_axis;

  /// Whittle's likelihood with the best amplitude of each axis.
  double ln_likelihood(const Shape& shape, double tau, double noise) const {
    const double T = tau / shape.tau_over_T();
    const Eigen::ArrayXd s = (-shape.p * (omega * T).square().log1p()).exp() + noise;
    double sum = 0;
    for (const auto& I : of_axis.colwise())
      sum -= s.log().sum() + static_cast<double>(s.size()) * std::log((I / s).mean());
    return sum;
  }
};

/// Best of a grid over the whole range of ln τ and ln r; the grid is halved about its best point until τ is told.
GustFit best_of(const Periodograms& seen, const Shape& shape) {
  const auto& rules = kWindowRules;
  constexpr int kTau = 6, kNoise = 3;  // steps to either side
  const double low = std::log(rules.tau_least), high = std::log(rules.tau_most);
  const double quiet = std::log(rules.noise_least), loud = std::log(rules.noise_most);
  double ln_tau = (low + high) / 2, tau_step = (high - low) / (2 * kTau), ln_r = (quiet + loud) / 2,
         r_step = (loud - quiet) / (2 * kNoise);
  GustFit best{0, -HUGE_VAL};
  for (int tau_reach = kTau, r_reach = kNoise; tau_step > rules.tau_told; tau_step /= 2, r_step /= 2) {
    const double about_tau = ln_tau, about_r = ln_r;
    for (int i = -tau_reach; i <= tau_reach; ++i)
      for (int j = -r_reach; j <= r_reach; ++j) {
        const double at = std::clamp(about_tau + i * tau_step, low, high), r = about_r + j * r_step;
        const double value = seen.ln_likelihood(shape, std::exp(at), std::exp(r));
        if (value > best.ln_likelihood) {
          best = {std::exp(at), value};
          ln_tau = at;
          ln_r = r;
        }
      }
    tau_reach = r_reach = 1;
  }
  return best;
}

}  // namespace

GustFits gust_fits(std::span<const std::vector<double>> axes, double rate_hz, const Band& band,
                   const std::function<double(std::size_t, double)>& passes) {
  const double n = static_cast<double>(axes.front().size());
  // The taper mixes neighbouring frequencies: the first that holds nothing of the mean is the second.
  const auto first = static_cast<std::size_t>(std::max(2.0, std::ceil(band.low_hz * n / rate_hz))),
             last = static_cast<std::size_t>(band.high_hz * n / rate_hz);
  GustFits fits;
  for (auto& fit : fits) fit.tau_s = 0.5 / rate_hz;
  if (last <= first) return fits;
  const auto count = static_cast<Eigen::Index>(last - first + 1);
  Periodograms seen{Eigen::ArrayXd(count), Eigen::ArrayXXd(count, 0)};
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    const auto [least, most] = std::minmax_element(axes[axis].begin(), axes[axis].end());
    if (*least == *most) continue;  // at rest: it tells nothing
    seen.of_axis.conservativeResize(Eigen::NoChange, seen.of_axis.cols() + 1);
    const auto tapered = hann_tapered(axes[axis]);
    for (std::size_t k = first; k <= last; ++k) {
      const double f = static_cast<double>(k) * rate_hz / n;
      const auto row = static_cast<Eigen::Index>(k - first);
      seen.omega[row] = 2 * std::numbers::pi * f;
      seen.of_axis(row, seen.of_axis.cols() - 1) = power(tapered, k) / passes(axis, f);
    }
  }
  if (seen.of_axis.cols() == 0) return fits;
  for (std::size_t k = 0; k < kGustShapes; ++k) fits[k] = best_of(seen, kShapes[k]);
  return fits;
}

}  // namespace backwash::study

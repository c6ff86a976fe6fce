// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/signals.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "core/study/windows/distributions.hpp"

namespace backwash::study {
std::vector<double> detrended(std::span<const double> x) {
  const double n = static_cast<double>(x.size()), middle = (n - 1) / 2;
  double mean = 0, slope = 0, square = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double s = static_cast<double>(i) - middle;
    mean += x[i] / n, slope += s * x[i], square += s * s;
  }
  slope = square > 0 ? slope / square : 0;
  std::vector<double> out(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) out[i] = x[i] - mean - slope * (static_cast<double>(i) - middle);
  return out;
}

std::vector<double> slow_course(std::span<const double> t, std::span<const double> x) {
  const auto n = static_cast<Eigen::Index>(x.size());
  if (n == 0) return {};
  const auto at = Eigen::Map<const Eigen::ArrayXd>(t.data(), n);
  const double low = at.minCoeff(), length = std::max(at.maxCoeff() - low, 1e-9);
  Eigen::MatrixXd powers(n, n < 4 ? 1 : n < 8 ? 2 : 3);
  powers.col(0).setOnes();
  for (Eigen::Index k = 1; k < powers.cols(); ++k) powers.col(k) = powers.col(k - 1).array() * (at - low) / length;
  const auto values = Eigen::Map<const Eigen::VectorXd>(x.data(), n);
  const Eigen::VectorXd fit = powers * powers.colPivHouseholderQr().solve(values);
  return {fit.data(), fit.data() + n};
}

Spread spread(std::span<const double> x) {
  double square = 0, product = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    square += x[i] * x[i];
    if (i > 0) product += x[i] * x[i - 1];
  }
  const double n = static_cast<double>(x.size());
  if (!(square > 0) || n < 4) return {0, 0};
  const double rho = std::clamp(product / square, 0.0, 0.98);
  const double samples = std::max(2.0, (n - 2) * (1 - rho * rho) / (1 + rho * rho));
  return {square / (n - 2), samples};
}

double ln_bias(double n) { return digamma(n / 2) - std::log(n / 2); }
double ln_variance(double n) { return trigamma(n / 2); }

Line rotor_line(std::span<const double> x, std::span<const double> t, std::span<const double> phase) {
  constexpr int kBeside = 4;  // on each side, 1 Hz apart from 1.5 Hz on
  using Complex = std::complex<double>;
  /// Power at the harmonic, and the sum at its neighbours.
  const auto powers = [&](double harmonic) {
    Complex at = 0;
    std::array<Complex, 2 * kBeside> beside{};
    for (std::size_t i = 1; i < x.size(); ++i) {
      const double d = x[i] - x[i - 1];  // the difference flattens the slow part of the spectrum
      const Complex line = std::polar(d, harmonic * phase[i]), hz = std::polar(1.0, 2 * std::numbers::pi * t[i]);
      at += line;
      Complex detuned = std::polar(1.0, 3 * std::numbers::pi * t[i]);
      for (std::size_t k = 0; k < kBeside; ++k, detuned *= hz)
        beside[2 * k] += line * detuned, beside[2 * k + 1] += line * std::conj(detuned);
    }
    double sum = 0;
    for (const Complex& z : beside) sum += std::norm(z);
    return std::pair(std::norm(at), sum / (2 * kBeside));
  };
  const double n = static_cast<double>(x.size()), seconds = t.back() - t.front(), rate = (n - 1) / seconds;
  const double hz_of_rotor = (phase.back() - phase.front()) / (2 * std::numbers::pi * seconds);
  Line found;
  double line = 0, beside = 0, count = 0;
  for (const double harmonic : {1.0, 2.0}) {
    // Folded next to 0 or to half the rate, the line and its neighbours lie on a curved spectrum.
    const double folded = std::abs(std::remainder(harmonic * hz_of_rotor, rate));
    if (folded < 6 || folded > rate / 2 - 1) continue;
    count += 1;
    const auto [at, around] = powers(harmonic);
    line += at, beside += around;
    if (harmonic > 1) continue;
    found.folded = folded / rate;
    const double gain = 2 * std::sin(std::numbers::pi * found.folded);  // of the difference
    found.amplitude2 = 4 * (at - around) / std::pow((n - 1) * gain, 2), found.floor2 = around / ((n - 1) * gain * gain);
  }
  // Each power is exponential: a sum of m has E ln = ln mean + ψ(m) − ln m, ln_bias of 2m samples.
  if (count > 0) found.excess = std::log(line / beside) - (ln_bias(2 * count) - ln_bias(16 * count));
  return found;
}

}  // namespace backwash::study

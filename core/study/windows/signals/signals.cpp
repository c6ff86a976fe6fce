// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/signals/signals.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/study/windows/gates/window_rules.hpp"
#include "core/study/windows/signals/distributions.hpp"

namespace backwash::study {
std::vector<double> detrended(std::span<const double> x) {
  const double n = static_cast<double>(x.size()), middle = (n - 1) / 2;
  double mean = 0, slope = 0, square = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double s = static_cast<double>(i) - middle;
    mean += x[i] / n;
    slope += s * x[i];
    square += s * s;
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
  const double low = at.minCoeff(), length = std::max(at.maxCoeff() - low, kWindowRules.stamp_error.value);
  const double windows = static_cast<double>(n);
  Eigen::MatrixXd powers(n, windows < kWindowRules.voltage_line ? 1 : windows < 2 * kWindowRules.voltage_line ? 2 : 3);
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
  if (!(square > 0) || n < kWindowRules.fewest_spread) return {0, 0};
  const double rho = std::clamp(product / square, 0.0, kWindowRules.correlated.value);
  const double samples = std::max(2.0, (n - 2) * (1 - rho * rho) / (1 + rho * rho));
  return {square / (n - 2), samples};
}

double left_by_a_line(std::size_t n, double dt, double tau) {
  const double count = static_cast<double>(n), middle = (count - 1) / 2, rho = std::exp(-dt / tau);
  // Of a function of time with the mean square 1 the process has Σ f_a f_b ρ^|a−b|/n².
  const auto taken = [&](const auto& f) {
    double square = 0, sum = 0, before = 0;  // Σ_{b<a} ρ^{a−b} f_b
    for (std::size_t a = 0; a < n; ++a) {
      const double here = f(static_cast<double>(a) - middle);
      sum += here * here + 2 * here * before;
      square += here * here;
      before = rho * (before + here);
    }
    return sum / (square * count);
  };
  return count * (1 - taken([](double) { return 1.0; }) - taken([](double s) { return s; })) / (count - 2);
}

double ln_bias(double n) { return digamma(n / 2) - std::log(n / 2); }
double ln_variance(double n) { return trigamma(n / 2); }

namespace {

constexpr int kBeside = static_cast<int>(kWindowRules.line_beside);  // on each side, 1 Hz apart from 1.5 Hz on

/// x without what it shares with its last sample as a first-order process: the ratio of its second autocorrelation to
/// its first, which white noise on top does not change. Gusts come out flat down to 0 Hz.
struct Flattened {
  std::vector<double> x;  ///< one fewer
  double decay;
  /// Square of what the filter leaves of a line at a share of the rate.
  double gain2(double folded) const { return 1 + decay * decay - 2 * decay * std::cos(2 * std::numbers::pi * folded); }
};

Flattened flattened(std::span<const double> x) {
  double first = 0, second = 0;
  for (std::size_t i = 2; i < x.size(); ++i) {
    first += x[i] * x[i - 1];
    second += x[i] * x[i - 2];
  }
  Flattened flat{{}, first > 0 ? std::clamp(second / first, 0.0, 1.0) : 0.0};
  for (std::size_t i = 1; i < x.size(); ++i) flat.x.push_back(x[i] - flat.decay * x[i - 1]);
  return flat;
}

/// Power at a phase, and mean power at its neighbours, each summed over blocks.
std::pair<double, double> powers(const std::vector<double>& x, std::span<const double> t, std::span<const double> phase,
                                 double harmonic, std::size_t blocks) {
  using Complex = std::complex<double>;
  double at = 0, beside = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    Complex own = 0;
    std::array<Complex, 2UL * kBeside> detunings{};
    for (std::size_t i = b * x.size() / blocks; i < (b + 1) * x.size() / blocks; ++i) {
      const Complex line = std::polar(x[i], harmonic * phase[i + 1]),
                    hz = std::polar(1.0, 2 * std::numbers::pi * t[i + 1]);
      own += line;
      Complex detuned = std::polar(1.0, 2 * std::numbers::pi * kWindowRules.line_nearest * t[i + 1]);
      for (std::size_t k = 0; k < kBeside; ++k, detuned *= hz) {
        detunings[2 * k] += line * detuned;
        detunings[2 * k + 1] += line * std::conj(detuned);
      }
    }
    at += std::norm(own);
    for (const Complex& z : detunings) beside += std::norm(z) / (2 * kBeside);
  }
  return {at, beside};
}

}  // namespace

std::optional<RotorLine> rotor_line(std::span<const double> x, std::span<const double> t,
                                    std::span<const double> phase) {
  const double n = static_cast<double>(x.size()), seconds = t.back() - t.front(), rate = (n - 1) / seconds;
  const double hz_of_rotor = (phase.back() - phase.front()) / (2 * std::numbers::pi * seconds);
  const auto blocks = static_cast<std::size_t>(std::max(1L, std::lround(seconds / kWindowRules.line_block)));
  const Flattened flat = flattened(x);
  RotorLine found;
  double line = 0, beside = 0, count = 0;
  for (const double harmonic : {1.0, 2.0}) {
    const double folded = std::abs(std::remainder(harmonic * hz_of_rotor, rate));
    // A window that cannot show the rotor's own rate is none, whatever twice the rate shows.
    if (folded < kWindowRules.least_folded || folded > rate / 2 - kWindowRules.from_half_rate) {
      if (harmonic > 1) break;
      return std::nullopt;
    }
    const auto [at, around] = powers(flat.x, t, phase, harmonic, blocks);
    count += static_cast<double>(blocks);
    line += at;
    beside += around;
    if (harmonic > 1) break;
    found.folded = folded / rate;
    const double gain2 = flat.gain2(found.folded);
    found.amplitude2 = 4 * static_cast<double>(blocks) * (at - around) / (std::pow(n - 1, 2) * gain2);
    found.floor2 = around / ((n - 1) * gain2);
  }
  // Each power is exponential: a sum of m has E ln = ln mean + ψ(m) − ln m, ln_bias of 2m samples.
  found.excess = std::log(line / beside) - (ln_bias(2 * count) - ln_bias(2 * 2 * kBeside * count));
  return found;
}

}  // namespace backwash::study

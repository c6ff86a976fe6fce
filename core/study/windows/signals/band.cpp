// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/signals/band.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace backwash::study {
namespace {

/// y_k = b0 x_k + b1 x_{k−1} + b2 x_{k−2} − a1 y_{k−1} − a2 y_{k−2}.
struct Biquad {
  double b0, b1, b2, a1, a2;
};

// Run forwards and backwards, a second-order Butterworth filter is 6 dB down at its own corner; the
// corner that gives −3 dB at f is f/k for a low-pass and f·k for a high-pass, k = (√2 − 1)^(1/4).
const double kTwoPasses = std::pow(std::numbers::sqrt2 - 1, 0.25);

Biquad low_pass(double f_hz, double rate_hz) {
  const double w = std::tan(std::numbers::pi * f_hz / rate_hz) / kTwoPasses;  // bilinear transform, prewarped
  const double scale = 1 / (1 + std::numbers::sqrt2 * w + w * w);
  return {w * w * scale, 2 * w * w * scale, w * w * scale, 2 * (w * w - 1) * scale,
          (1 - std::numbers::sqrt2 * w + w * w) * scale};
}

Biquad high_pass(double f_hz, double rate_hz) {
  const double w = std::tan(std::numbers::pi * f_hz / rate_hz) * kTwoPasses;
  const double scale = 1 / (1 + std::numbers::sqrt2 * w + w * w);
  return {scale, -2 * scale, scale, 2 * (w * w - 1) * scale, (1 - std::numbers::sqrt2 * w + w * w) * scale};
}

/// In place, from rest at the first value.
void run(const Biquad& f, std::vector<double>& x) {
  const double steady = (f.b0 + f.b1 + f.b2) / (1 + f.a1 + f.a2);
  double x1 = x.front(), x2 = x1, y1 = steady * x1, y2 = y1;
  for (double& value : x) {
    const double y = f.b0 * value + f.b1 * x1 + f.b2 * x2 - f.a1 * y1 - f.a2 * y2;
    x2 = x1;
    x1 = value;
    y2 = y1;
    y1 = y;
    value = y;
  }
}

void both_ways(const Biquad& f, std::vector<double>& x) {
  run(f, x);
  std::reverse(x.begin(), x.end());
  run(f, x);
  std::reverse(x.begin(), x.end());
}

}  // namespace

Band Band::within(double rate_hz) const noexcept {
  return {low_hz, std::min(high_hz, kWindowRules.rate_share * rate_hz)};
}

std::vector<double> band_passed(std::span<const double> signal, double rate_hz, const Band& band) {
  const std::size_t n = signal.size();
  const std::size_t pad = std::min(n - 1, static_cast<std::size_t>(std::lround(rate_hz / band.low_hz)));
  std::vector<double> x;
  x.reserve(n + 2 * pad);
  for (std::size_t k = pad; k > 0; --k) x.push_back(signal[k]);
  x.insert(x.end(), signal.begin(), signal.end());
  for (std::size_t k = 1; k <= pad; ++k) x.push_back(signal[n - 1 - k]);
  both_ways(low_pass(band.high_hz, rate_hz), x);
  both_ways(high_pass(band.low_hz, rate_hz), x);
  return {x.begin() + static_cast<std::ptrdiff_t>(pad), x.begin() + static_cast<std::ptrdiff_t>(pad + n)};
}

double loop_attenuation(const loop::PositionLoop& loop, int axis, double tau_w, const Band& band) {
  const double low = std::log(band.low_hz), high = std::log(band.high_hz);  // even steps in ln f: smooth in it
  const int steps = static_cast<int>(std::ceil((high - low) / kWindowRules.integral_step));
  double passed = 0, whole = 0;
  for (int i = 0; i < steps; ++i) {
    const double f = std::exp(low + (high - low) * (i + 0.5) / steps), omega = 2 * std::numbers::pi * f;
    const double density = f / (1 + omega * omega * tau_w * tau_w);
    passed += density * loop.passes(axis, f);
    whole += density;
  }
  return passed / whole;
}

}  // namespace backwash::study

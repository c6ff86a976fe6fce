// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/signals/gust_spectrum.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

namespace backwash::study {
namespace {

constexpr double kRate = 50, kTau = 0.2;
constexpr std::size_t kRows = 400;

/// Gusts of variance 1 by their textbook recursions in time, not by the spectra that are fitted; noise added.
class Gusts {
 public:
  Gusts(GustShape shape, double noise, std::uint64_t seed) : shape_(shape), noise_(noise), random_(seed) {}

  std::vector<double> stretch() {
    auto x = shape_ == GustShape::karman ? harmonics() : filtered();
    for (double& value : x) value += noise_ * normal_(random_);
    return x;
  }

 private:
  /// White noise through one lag of τ, or through two of τ/2 each, at 32 steps a row.
  std::vector<double> filtered() {
    const bool twice = shape_ == GustShape::second_order;
    constexpr int kSteps = 32;
    const double keep = std::exp(-1 / (kRate * kSteps) / (twice ? kTau / 2 : kTau));
    std::vector<double> out;
    for (std::size_t k = 0; k < kRows + 100; ++k) {
      for (int i = 0; i < kSteps; ++i) {
        one_ = keep * one_ + std::sqrt(1 - keep * keep) * normal_(random_);
        two_ = keep * two_ + (1 - keep) * one_;
      }
      if (k >= 100) out.push_back(twice ? std::numbers::sqrt2 * two_ : one_);
    }
    return out;
  }
  /// von Kármán's spectrum as MIL-F-8785C prints it: (1 + (1.339 ω L/V)²)^(−5/6), L/V = τ.
  std::vector<double> harmonics() {
    std::vector<double> out(kRows);
    constexpr double kStep = 0.02;
    double variance = 0;
    for (double f = kStep / 2; f < 100; f += kStep) {
      const double s = std::pow(1 + std::pow(1.339 * 2 * std::numbers::pi * f * kTau, 2), -5.0 / 6);
      const double a = std::sqrt(s) * normal_(random_), b = std::sqrt(s) * normal_(random_);
      variance += s;
      for (std::size_t k = 0; k < kRows; ++k) {
        const double angle = 2 * std::numbers::pi * f * static_cast<double>(k) / kRate;
        out[k] += a * std::cos(angle) + b * std::sin(angle);
      }
    }
    for (double& x : out) x /= std::sqrt(variance);
    return out;
  }

  GustShape shape_;
  double noise_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double one_ = 0, two_ = 0;
};

/// Median of τ over 40 stretches by the shape that is likeliest over all of them, and that shape.
std::pair<double, GustShape> told(Gusts gusts) {
  std::array<std::vector<double>, kGustShapes> taus;
  std::array<double, kGustShapes> sum{};
  for (int n = 0; n < 40; ++n) {
    const std::vector<std::vector<double>> axes{gusts.stretch(), gusts.stretch(), gusts.stretch()};
    const GustFits fits = gust_fits(axes, kRate, Band{}.within(kRate), [](std::size_t, double) { return 1.0; });
    for (std::size_t k = 0; k < kGustShapes; ++k) {
      taus[k].push_back(fits[k].tau_s);
      sum[k] += fits[k].ln_likelihood;
    }
  }
  const auto best = static_cast<std::size_t>(std::max_element(sum.begin(), sum.end()) - sum.begin());
  std::sort(taus[best].begin(), taus[best].end());
  return {taus[best][20], static_cast<GustShape>(best)};
}

class GustSpectrum : public testing::TestWithParam<std::pair<GustShape, double>> {};

TEST_P(GustSpectrum, TellsShapeAndCorrelationTimeThroughBandAndNoise) {
  const auto [shape, noise] = GetParam();
  const auto [tau, found] = told(Gusts(shape, noise, 1));
  EXPECT_EQ(found, shape);
  EXPECT_NEAR(tau, kTau, 0.1 * kTau);
}

std::string named(const testing::TestParamInfo<std::pair<GustShape, double>>& told) {
  const std::string names[] = {"VonKarman", "FirstOrder", "SecondOrder"};
  return names[static_cast<std::size_t>(told.param.first)] + (told.param.second > 0 ? "InNoise" : "");
}

INSTANTIATE_TEST_SUITE_P(Shapes, GustSpectrum,
                         testing::Values(std::pair{GustShape::karman, 0.0}, std::pair{GustShape::first_order, 0.0},
                                         std::pair{GustShape::second_order, 0.0},
                                         std::pair{GustShape::first_order, 0.2},
                                         std::pair{GustShape::second_order, 0.2}),
                         named);

TEST(GustSpectrum, AVehicleAtRestAndAStretchTooShortCountAsWhite) {
  const std::vector<std::vector<double>> still(3, std::vector<double>(100, 0.3)), brief(3, std::vector<double>(4, 1));
  for (const auto& axes : {still, brief})
    for (const auto& fit : gust_fits(axes, kRate, Band{}.within(kRate), [](std::size_t, double) { return 1.0; }))
      EXPECT_EQ(fit.tau_s, 0.5 / kRate);
}

}  // namespace
}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/distributions.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/study/inference/intervals.hpp"

namespace backwash::study {
namespace {

/// Mass of Student's t between −x and x: Simpson's rule over the density.
double student_mass(double x, double n) {
  constexpr int kSteps = 20000;
  const double scale = std::exp(std::lgamma((n + 1) / 2) - std::lgamma(n / 2)) / std::sqrt(n * std::numbers::pi);
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double at = -x + 2 * x * i / kSteps, weight = i == 0 || i == kSteps ? 1 : i % 2 ? 4 : 2;
    sum += weight * std::pow(1 + at * at / n, -(n + 1) / 2);
  }
  return scale * sum * 2 * x / (3 * kSteps);
}

TEST(Distributions, StudentsQuantileHoldsItsShareOfTheDensity) {
  for (const double n : {1.0, 3.0, 5.0, 11.0, 40.0}) {
    EXPECT_NEAR(student_mass(student_975(n), n), 0.95, 1e-6) << n;
    EXPECT_NEAR(student_mass(student_quantile(1 - 0.05 / 4, n), n), 0.975, 1e-6) << n;
  }
}

// With two degrees above, the tail of F is (1 + 2f/n)^(−n/2).
TEST(Distributions, TheQuantileOfFWithTwoDegreesIsItsClosedForm) {
  for (const double n : {3.0, 10.0, 50.0})
    EXPECT_NEAR(std::pow(1 + 2 * f_quantile(0.95, 2, n) / n, -n / 2), 0.05, 1e-12);
}

TEST(Distributions, DigammaAndTrigammaAreTheDerivativesOfTheLogarithmOfGamma) {
  EXPECT_NEAR(digamma(1), -std::numbers::egamma, 1e-14);
  EXPECT_NEAR(trigamma(1), std::numbers::pi * std::numbers::pi / 6, 1e-14);
  for (const double x : {0.5, 2.7, 9.0, 120.0}) {
    EXPECT_NEAR(digamma(x + 1), digamma(x) + 1 / x, 1e-12) << x;
    EXPECT_NEAR(trigamma(x + 1), trigamma(x) - 1 / (x * x), 1e-12) << x;
    EXPECT_NEAR(digamma(x), (std::lgamma(x + 1e-4) - std::lgamma(x - 1e-4)) / 2e-4, 1e-6) << x;
  }
}

}  // namespace
}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#include "core/types/quantile.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace backwash {
namespace {

// By counting, not by sorting: so many are smaller, so many no larger, as its place says.
TEST(Quantile, HasAsManyBelowItAsItsPlaceAndTheOthersAbove) {
  std::mt19937 random(7);
  for (int n = 1; n < 60; ++n) {
    std::vector<double> values;
    for (int k = 0; k < n; ++k) values.push_back(static_cast<double>(random() % 20));
    for (const double share : {0.0, 0.05, 0.3, 0.5, 0.95, 1.0}) {
      const double q = quantile(values, share);
      const auto place = std::lround(std::floor(share * (n - 1) + 0.5));
      EXPECT_LE(std::ranges::count_if(values, [&](double v) { return v < q; }), place) << n << " " << share;
      EXPECT_GT(std::ranges::count_if(values, [&](double v) { return v <= q; }), place) << n << " " << share;
    }
  }
}

TEST(Quantile, OfAnEvenCountTheMiddleIsTheUpperOneOfTheTwo) {
  EXPECT_EQ(quantile({4, 1, 3, 2}, 0.5), 3);
  EXPECT_EQ(quantile({5, 1, 3}, 0.5), 3);
}

}  // namespace
}  // namespace backwash

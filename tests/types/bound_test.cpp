// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "core/types/disturbance.hpp"

namespace backwash {
namespace {

/// As docs/model.md 3-7 is written, direction by direction.
DisturbanceBound as_written(const Variance& sigma, const BoundModel& model) {
  DisturbanceBound b;
  for (std::size_t d = 0; d < kDirections; ++d) {
    const double variance = sigma.along(unit(static_cast<Direction>(d)));
    b.w[d] = (d == kZ ? model.mean_vertical : model.mean_horizontal) +
             model.kappa * std::sqrt(variance > 0 ? variance : 0.0);
  }
  return b;
}
void expect_same_bits(const Variance& sigma) {
  const BoundModel model{2.7, 0.05, 0.02, 0.15};
  const auto found = bound(sigma, model), expected = as_written(sigma, model);
  for (std::size_t d = 0; d < kDirections; ++d) {
    if (std::isnan(expected.w[d]) && std::isnan(found.w[d])) continue;
    EXPECT_EQ(std::bit_cast<std::uint64_t>(found.w[d]), std::bit_cast<std::uint64_t>(expected.w[d])) << d;
  }
}

TEST(Bound, IsBitForBitTheEquationInEachDirection) {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> some(-0.2, 1);
  for (int n = 0; n < 10000; ++n) {
    const double h = some(rng), xy = n % 3 == 0 ? 0 : some(rng) / 4;
    expect_same_bits({h, xy, 0, n % 2 == 0 ? h : some(rng), 0, some(rng)});
    expect_same_bits({some(rng), some(rng), some(rng), some(rng), some(rng), some(rng)});
    const auto single = [](double x) { return static_cast<double>(static_cast<float>(x)); };
    expect_same_bits({single(h), single(xy), 0, single(h), 0, single(some(rng))});
  }
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()})
    for (int which = 0; which < 4; ++which) {
      Variance sigma{0.1, 0, 0, 0.1, 0, 0.2};
      (which == 0 ? sigma.xx : which == 1 ? sigma.xy : which == 2 ? sigma.yy : sigma.zz) = bad;
      expect_same_bits(sigma);
    }
}

}  // namespace
}  // namespace backwash

// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "core/adapt/adaptation.hpp"
#include "tests/support/allocations.hpp"

namespace backwash::adapt {
namespace {

TEST(AdaptRealTime, ATickDoesNotAllocate) {
  Adaptation adaptation{Gusts{}};
  EXPECT_GT(test::allocations_during([] { delete new int; }), 0);  // the counter counts
  double told = 0;
  EXPECT_EQ(test::allocations_during([&] {
              for (int k = 0; k < 3000; ++k) {
                adaptation.add({0.02 * k, Vec3::Constant(k % 7 - 3), Vec3::Ones(), static_cast<AirClass>(k / 100 % 5)});
                told += adaptation.factor(AirClass::wall) + adaptation.of(AirClass::wall).ln_evidence();
              }
            }),
            0);
  EXPECT_GT(told, 0);
  const AirSample sample;
  static_assert(noexcept(adaptation.add(sample))&& noexcept(adaptation.factor(AirClass::wall)));
}

}  // namespace
}  // namespace backwash::adapt

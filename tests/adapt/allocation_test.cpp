// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "core/adapt/in_flight.hpp"
#include "tests/support/allocations.hpp"

namespace backwash::adapt {
namespace {

TEST(AdaptRealTime, ATickDoesNotAllocate) {
  Adaptation adaptation{Gusts{}};
  EXPECT_GT(test::allocations_during([] { ::operator delete(::operator new(1)); }), 0);  // the counter counts
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

TEST(AdaptRealTime, ATickInFlightDoesNotAllocate) {
  InFlightConstants constants;
  constants.controller = {{10, 12}, {5.5, 6}, 0.02, 0, 0.05};
  InFlight air(constants);
  int grown = 0;
  EXPECT_EQ(test::allocations_during([&] {
              for (int k = 0; k < 3000; ++k) {
                AirTick tick{20'000'000LL * k, 0, {}, {}, Vec3::Constant(0.01), AirClass::wall};
                tick.state.v_W.x() = 0.2 * std::sin(0.2 * k);
                grown += air.add(tick);
              }
            }),
            0);
  EXPECT_GT(grown, 0) << "the ticks in which a factor grows are among them";
  const AirTick tick;
  static_assert(noexcept(air.add(tick)));
}

}  // namespace
}  // namespace backwash::adapt

// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <vector>

#include "core/adapt/in_flight.hpp"
#include "tests/gusts/flown_loop.hpp"
#include "tests/support/allocations.hpp"

namespace backwash::adapt {
namespace {

TEST(AdaptRealTime, ATickDoesNotAllocate) {
  InFlightConstants constants;
  constants.controller = gusts::quad_5in();
  constants.controller.feedback_delay = 0.03;
  InFlight air(constants);
  gusts::Trial trial;
  trial.factor = 8;
  gusts::FlownLoop loop(constants.controller, trial);
  std::vector<AirTick> ticks;
  while (ticks.size() < 3000) ticks.push_back(loop.tick());
  ticks[2000].frame = 1;                                                                 // it begins anew
  EXPECT_GT(test::allocations_during([] { ::operator delete(::operator new(1)); }), 0);  // the counter counts
  int grown = 0;
  EXPECT_EQ(test::allocations_during([&] {
              for (const AirTick& tick : ticks) grown += air.add(tick) + (air.cause(tick.air) == Cause::air);
              air.end();
              air.carry_out(AirOrder::reset);
            }),
            0);
  EXPECT_GT(grown, 0) << "the ticks in which a factor grows are among them";
  static_assert(noexcept(air.add(ticks[0]))&& noexcept(air.cause(AirClass::wall))&& noexcept(air.end()));
}

}  // namespace
}  // namespace backwash::adapt

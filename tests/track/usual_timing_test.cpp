// SPDX-License-Identifier: BSD-3-Clause
// Of odometry at 20 Hz and more without a stated latency nothing is dated back (docs/model.md 4-13).
#include <gtest/gtest.h>

#include "tests/track/flown/flown.hpp"

namespace backwash::track::test {
namespace {

TEST(UsualTiming, APoseIsJudgedAgainstTheSetOfTheTickHoweverOldItIsWithinIt) {
  Flown flown;
  flown.age_ns = 15'000'000;
  for (int n = 0; n < 5; ++n) {
    const TickOutput& out = flown.step();
    ASSERT_TRUE(out.inside.judged);
    EXPECT_EQ(out.inside.center, flown.segment.tube[out.judged_index].center.p_W);
    EXPECT_EQ(out.inside.half_widths, flown.segment.tube[out.judged_index].half_widths);
  }
}

}  // namespace
}  // namespace backwash::track::test

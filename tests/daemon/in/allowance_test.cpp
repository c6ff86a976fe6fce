// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/in/allowance.hpp"

#include <gtest/gtest.h>

namespace backwash::daemon {
namespace {

int taken_at(Allowance& allowance, std::int64_t now_ns) {
  int taken = 0;
  for (int n = 0; n < 100; ++n) taken += allowance.take(now_ns);
  return taken;
}

TEST(AllowanceTest, IsABurstThenOneAPeriodAndABurstAgainAfterARest) {
  Allowance allowance;
  std::int64_t now_ns = 1'000'000'000'000;
  EXPECT_EQ(taken_at(allowance, now_ns), Allowance::kBurst);
  for (int n = 0; n < 10; ++n) EXPECT_EQ(taken_at(allowance, now_ns += Allowance::kPrice_ns), 1);
  EXPECT_EQ(taken_at(allowance, now_ns += 3'600'000'000'000), Allowance::kBurst) << "an hour is worth no more";
}

}  // namespace
}  // namespace backwash::daemon

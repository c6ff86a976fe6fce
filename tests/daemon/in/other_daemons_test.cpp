// SPDX-License-Identifier: BSD-3-Clause
// Row 52 of docs/faults.md: two daemons in one name space.
#include "services/backwashd/in/other_daemons.hpp"

#include <gtest/gtest.h>

namespace backwash::daemon {
namespace {

constexpr std::int64_t kStart = 5'000'000'000, kMoment = 1'000'000;
const dds::Guid kOtherWriter{7};

TEST(OtherDaemonsTest, OneThatWouldNotBeKnownYetForbidsToEnable) {
  OtherDaemons others(kStart);
  const auto first = others.look({}, kStart);
  ASSERT_TRUE(first);
  EXPECT_NE(first->find("no second has passed since the start"), std::string::npos) << *first;
  EXPECT_FALSE(others.look({}, kStart + OtherDaemons::kDiscovery_ns - kMoment)) << "said already";
  EXPECT_EQ(others.look({}, kStart + OtherDaemons::kDiscovery_ns), "");
  EXPECT_FALSE(others.look({}, kStart + 2 * OtherDaemons::kDiscovery_ns));
}

TEST(OtherDaemonsTest, OneThatIsKnownForbidsToEnableUntilItIsGone) {
  OtherDaemons others(kStart);
  const std::string named = "another daemon in this namespace, writer " + dds::text(kOtherWriter);
  EXPECT_EQ(others.look(kOtherWriter, kStart), named) << "known at once";
  const std::int64_t later = kStart + 10 * OtherDaemons::kDiscovery_ns;
  EXPECT_FALSE(others.look(kOtherWriter, later));
  EXPECT_EQ(others.look({}, later), "");
  EXPECT_EQ(others.look(kOtherWriter, later + kMoment), named);
}

}  // namespace
}  // namespace backwash::daemon

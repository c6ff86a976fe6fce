// SPDX-License-Identifier: BSD-3-Clause
// Row 48 of docs/faults.md: whose odometry, loop closures, maps and scans are listened to.
#include "services/backwashd/out/bound_writer.hpp"

#include <gtest/gtest.h>

namespace backwash::daemon {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
const dds::Guid kFirst{1}, kSecondWriter{2};

class BoundWriterTest : public testing::Test {
 protected:
  BoundWriter bound_{"a map"};
  bool let_go(std::vector<dds::Guid> departed, bool replaceable, double now_s) {
    return bound_.let_go(departed, replaceable, static_cast<std::int64_t>(now_s * kSecond));
  }
};

TEST_F(BoundWriterTest, HearsTheFirstWhoseSampleWasGoodAndNamesBothToTheOthers) {
  EXPECT_TRUE(bound_.hears(kFirst) && bound_.hears(kSecondWriter));
  EXPECT_TRUE(bound_.bind(kFirst));
  EXPECT_FALSE(bound_.bind(kFirst)) << "already bound";
  EXPECT_TRUE(bound_.hears(kFirst));
  EXPECT_FALSE(bound_.hears(kSecondWriter));
  EXPECT_EQ(bound_.refusal(kSecondWriter),
            "a map of writer " + dds::text(kSecondWriter) + ": that of " + dds::text(kFirst) + " is in use");
}

// Nobody has to disable for the successor of a mapper, which is heard in flight.
TEST_F(BoundWriterTest, OneThatIsGoneIsToBeDisabledForOnlyWhereItStays) {
  const auto said = [&](bool replaceable) {
    let_go({kFirst}, replaceable, 10);
    const std::string line = bound_.refusal(kSecondWriter);
    return line.substr(line.find(dds::text(kFirst)) + dds::text(kFirst).size());
  };
  bound_.bind(kFirst);
  EXPECT_EQ(said(false), ", which is gone, was flown with: disable first");
  EXPECT_EQ(said(true), ", which is gone, is let go in a moment");
}

TEST_F(BoundWriterTest, OneThatIsGoneMayBeReplacedHalfASecondLater) {
  bound_.bind(kFirst);
  EXPECT_FALSE(let_go({kSecondWriter}, true, 10)) << "another one went";
  EXPECT_FALSE(let_go({kFirst}, true, 11));
  EXPECT_FALSE(let_go({}, true, 11.4));
  EXPECT_FALSE(bound_.hears(kSecondWriter));
  EXPECT_TRUE(let_go({}, true, 11.6));
  EXPECT_TRUE(bound_.bind(kSecondWriter));
  EXPECT_FALSE(let_go({}, true, 20)) << "the new one is there";
}

TEST_F(BoundWriterTest, OneThatWasFlownWithIsNotReplacedInFlight) {
  bound_.bind(kFirst);
  EXPECT_FALSE(let_go({kFirst}, false, 10));
  EXPECT_FALSE(let_go({}, false, 100));
  EXPECT_NE(bound_.refusal(kSecondWriter).find("which is gone, was flown with: disable first"), std::string::npos);
  EXPECT_TRUE(let_go({}, true, 101));
  EXPECT_TRUE(bound_.hears(kSecondWriter));
}

}  // namespace
}  // namespace backwash::daemon

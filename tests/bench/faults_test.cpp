// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/emulation/faults.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

namespace backwash::bench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using enum Fault::Kind;

Fault fault(Fault::Kind kind) { return {.kind = kind, .from = 1, .until = 2}; }

/// Stamps of what comes out, in 10 ms, of samples that go in each 10 ms for 3 s.
std::vector<std::pair<int, int>> stamps(const Fault& f) {
  FaultyChannel<VioSample> channel({f});
  std::vector<std::pair<int, int>> all;  // when, which
  for (int n = 0; n < 300; ++n) {
    VioSample in{.stamp = n * 0.01};
    in.estimate.p_W.x() = n;
    for (const VioSample& out : channel.pass(in, n * 0.01 + 1e-9))
      all.emplace_back(n, int(std::lround(out.estimate.p_W.x())));
  }
  return all;
}
long count(const std::vector<std::pair<int, int>>& all, int from, int until) {
  return std::ranges::count_if(all, [&](const auto& p) { return p.first >= from && p.first < until; });
}

TEST(FaultyChannel, PassesEverythingOutsideItsFaults) {
  for (const auto kind : {off, stuck, garbage, wrong, intermittent}) {
    Fault f = fault(kind);
    f.on = f.off = 0.1;
    const auto all = stamps(f);
    EXPECT_EQ(count(all, 0, 100), 100);
    EXPECT_EQ(count(all, 200, 300), 100);
    for (const auto& [when, which] : all) EXPECT_TRUE((when >= 100 && when < 200) || when == which) << when;
  }
}
TEST(FaultyChannel, OffPassesNothing) { EXPECT_EQ(count(stamps(fault(off)), 100, 200), 0); }
TEST(FaultyChannel, StuckRepeatsTheLastPoseWithNewStamps) {
  FaultyChannel<VioSample> channel({fault(stuck)});
  channel.pass(VioSample{{Vec3(1, 2, 3), Vec3::Zero()}, {1, 0, 0, 0}, 0.99}, 0.99);
  const auto out = channel.pass(VioSample{{Vec3(4, 5, 6), Vec3::Zero()}, {1, 0, 0, 0}, 1.5}, 1.5);
  ASSERT_EQ(out.size(), 1U);
  EXPECT_EQ(out[0].estimate.p_W, Vec3(1, 2, 3));
  EXPECT_EQ(out[0].stamp, 1.5);
}
TEST(FaultyChannel, DelayedComesLaterAndInOrder) {
  Fault f = fault(delayed);
  f.delay = 0.25;
  const auto all = stamps(f);
  EXPECT_EQ(all.size(), 300U);
  EXPECT_EQ(count(all, 100, 125), 0);
  for (std::size_t n = 1; n < all.size(); ++n) EXPECT_EQ(all[n].second, all[n - 1].second + 1);
  EXPECT_EQ(all[100].first, 125);
}
TEST(FaultyChannel, SlowOdometryComesAtItsRateAndIsFresh) {
  Fault f = fault(slow);
  f.rate = 10;
  const auto all = stamps(f);
  EXPECT_NEAR(static_cast<double>(count(all, 100, 200)), 10, 1);
  for (const auto& [when, which] : all) EXPECT_EQ(when, which);
}
TEST(FaultyChannel, ASlowLinkKeepsEveryByte) {
  Fault f{.channel = Fault::Channel::up, .kind = slow, .from = 0, .until = 100, .rate = 1000};
  FaultyChannel<Bytes> channel({f});
  std::vector<std::size_t> left;  // bytes that have come out by each second
  std::size_t out = 0;
  for (int ms = 0; ms < 5000; ++ms) {
    std::optional<Bytes> in;
    if (ms < 1000 && ms % 10 == 0) in = Bytes(30, 7);
    for (const Bytes& b : channel.pass(in, ms * 1e-3)) out += b.size();
    if (ms % 1000 == 999) left.push_back(out);
  }
  EXPECT_THAT(left, ElementsAre(990, 1980, 2970, 3000, 3000));
}
TEST(FaultyChannel, IntermittentPassesItsShare) {
  Fault f = fault(intermittent);
  f.on = 0.1;
  f.off = 0.3;
  EXPECT_EQ(count(stamps(f), 100, 200), 30);
}
TEST(FaultyChannel, AWrongLinkFlipsOneBitAndGarbageIsNoise) {
  const Bytes in(100, 0x55);
  FaultyChannel<Bytes> flips({{.channel = Fault::Channel::up, .kind = wrong, .from = 0, .until = 9}});
  const Bytes flipped = flips.pass(in, 1).at(0);
  int bits = 0;
  for (std::size_t n = 0; n < in.size(); ++n) bits += __builtin_popcount(flipped.at(n) ^ in[n]);
  EXPECT_EQ(bits, 1);
  FaultyChannel<Bytes> noise({{.channel = Fault::Channel::up, .kind = garbage, .from = 0, .until = 9}});
  const Bytes out = noise.pass(in, 1).at(0);
  EXPECT_EQ(out.size(), in.size());
  EXPECT_LT(std::ranges::count(out, 0x55), 10);
}
TEST(FaultyChannel, AWrongMapLiesElsewhereByWholeVoxels) {
  map::OccupancyGrid grid(Vec3(0, 0, 0), 0.1, Index3(4, 4, 4), map::Cell::free);
  grid.set(Index3(1, 2, 3), map::Cell::occupied);
  FaultyChannel<MapMessage> channel(
      {{.channel = Fault::Channel::map, .kind = wrong, .from = 0, .until = 9, .offset = Vec3(0.31, 0, -0.1)}});
  const auto out = channel.pass(MapMessage{grid}, 1).at(0);
  EXPECT_TRUE(out.grid.origin().isApprox(Vec3(0.3, 0, -0.1)));
  EXPECT_TRUE(out.grid.occupied(Index3(1, 2, 3)));
}

struct TimelineFile : ::testing::Test {
  std::string path = ::testing::TempDir() + "timeline.toml";
  auto load(const std::string& text) {
    std::ofstream(path) << text;
    return load_timeline(path);
  }
  void TearDown() override { std::filesystem::remove(path); }
};

TEST_F(TimelineFile, IsReadWithItsFaultsAndExpectations) {
  const auto t = load(
      "after = 'start'\n[[fault]]\nchannel = 'odometry'\nkind = 'wrong'\nfrom = 1\nuntil = 2.5\noffset = [0.1, 0, 0]\n"
      "[[fault]]\nchannel = 'down'\nkind = 'intermittent'\nfrom = 3\nuntil = 4\non = 0.1\noff = 0.2\n"
      "[[expect]]\nwhat = 'moved'\nat_most = 0.5\n");
  ASSERT_TRUE(t) << t.error().message;
  EXPECT_FALSE(t->after_arming);
  ASSERT_EQ(t->of(Fault::Channel::odometry).size(), 1U);
  EXPECT_EQ(t->faults[0].offset, Vec3(0.1, 0, 0));
  EXPECT_EQ(t->faults[1].off, 0.2);
  EXPECT_EQ(t->expectations.at(0).limit, 0.5);
}
TEST_F(TimelineFile, NamesLineKeyAndWhatWouldBeRight) {
  const std::string head = "[[fault]]\nchannel = 'odometry'\n";
  const std::pair<std::string, std::string> wrongs[] = {
      {head + "kind = 'of'\nfrom = 1\nuntil = 2\n", ":3: key 'kind' = of: needs one of off, stuck"},
      {head + "kind = 'off'\nfrom = 1\nuntil = 0.5\n", ":5: key 'until' = 0.5: needs a number from 1"},
      {head + "kind = 'slow'\nfrom = 1\nuntil = 2\n", ":1: key 'rate' is missing"},
      {head + "kind = 'off'\nfrom = 1\nuntil = 2\nrate = 3\n", ":6: key 'rate' = 3: is not known here"},
      {"[[expect]]\nwhat = 'moved'\nat_most = nan\n", ":3: key 'at_most' = nan: needs a number"},
      {"faults = 1\n", ":1: key 'faults' = 1: is not known here"},
      {"fault = 1\n", ":1: key 'fault' = 1: needs tables"},
      {"[[fault]\n", ":1: "}};
  for (const auto& [text, message] : wrongs) {
    const auto t = load(text);
    ASSERT_FALSE(t) << text;
    EXPECT_THAT(t.error().message, HasSubstr(path + message)) << text;
  }
  EXPECT_EQ(load_timeline("/nowhere").error().kind, config::ConfigError::Kind::not_found);
}

TEST(Judge, PassesWhatWasKeptAndFailsTheRest) {
  using What = Expectation::What;
  Judge judge({{What::landed, 9, 0},
               {What::airborne, 9, 0},
               {What::moved, 0, 0.5},
               {What::moved, 0, 0.05},
               {What::speed, 0, 1.0},
               {What::clearance, 0, 0.1},
               {What::clearance, 0, 0.3},
               {What::landed, 99, 0}},
              2.0);
  for (double t = 0; t < 10; t += 0.1) judge.take({{Vec3(t < 2 ? 5 : 0.03 * t, 0, 1), Vec3(0.5, 0, 0)}, t > 8, 0.2}, t);
  std::vector<bool> passed;
  for (const auto& v : judge.judgements()) passed.push_back(v.passed);
  EXPECT_THAT(passed, ElementsAre(true, false, true, false, true, true, false, false));
}
TEST(Judge, PassesNothingThatItDidNotSee) {
  using What = Expectation::What;
  for (const auto& v : Judge({{What::moved, 0, 9}, {What::speed, 0, 9}, {What::landed, 0, 0}}, 1).judgements())
    EXPECT_FALSE(v.passed) << v.what;
}

}  // namespace
}  // namespace backwash::bench

// SPDX-License-Identifier: BSD-3-Clause
// Sequences that once broke a promise, cut down to the events that it took.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include "tests/fuzz/sequence/daemon_rig.hpp"

namespace backwash::fuzz {
namespace {

using Kind = Event::Kind;

class Regression : public testing::Test {
 protected:
  void SetUp() override { spdlog::set_level(spdlog::level::off); }
  void TearDown() override { spdlog::set_level(spdlog::level::info); }

  /// An operator enables, takes off and is in the air at tick 330; then this.
  static void expect_kept(std::vector<Event> events, int ticks = 1000) {
    events.insert(events.begin(), {{62, Kind::operate, 90}, {200, Kind::operate, 90, 0.5, 0.5, 0.5}});
    DaemonRig rig(events, daemon::test::Medium::udp);
    const auto violation = rig.run(ticks);
    EXPECT_FALSE(violation) << "tick " << violation->tick << ": " << violation->what;
    EXPECT_GT(rig.spent()[static_cast<std::size_t>(Mode::tracking)], 50) << "it never flew";
  }
};

TEST_F(Regression, AStopFourTicksAfterAGotoIsNotFlownOver) {
  for (const int late : {0, 1, 3, 20, 60})
    expect_kept(
        {{449, Kind::late_segment, 1 + late}, {450, Kind::operate, 95, 0.9, 0.5, 0.5}, {454, Kind::operate, 1}});
}

TEST_F(Regression, ATakeoffWhoseSegmentIsLateArmsInTheTickThatAcceptsIt) {
  for (const int late : {5, 36, 56}) {
    DaemonRig rig({{62, Kind::operate, 90}, {199, Kind::late_segment, late}, {200, Kind::operate, 90, 0.5, 0.5, 0.5}},
                  daemon::test::Medium::udp);
    const auto violation = rig.run(600);
    EXPECT_FALSE(violation) << violation->what;
  }
}

TEST_F(Regression, AStopWhileEnablingEndsIt) {
  for (const int after : {1, 8, 40})
    expect_kept({{400, Kind::operate, 20}, {760, Kind::operate, 90}, {760 + after, Kind::operate, 1}}, 1400);
}

TEST_F(Regression, QuietDoesNotAnswerATimesync) {
  expect_kept({{500, Kind::missed, 30}, {510, Kind::timesync, 1}, {700, Kind::timesync, 1}});
}

TEST_F(Regression, AVelocityThatNoFloatHoldsIsNotForwarded) {
  for (const double velocity : {1e39, -9.6e38, 1e300})
    expect_kept({{500, Kind::vio_huge, 2, velocity, 5}, {600, Kind::vio_huge, 1, velocity, 3}});
}

TEST_F(Regression, AVioThatDriftsWhileEnablingIsNoResetOfTheAutopilot) {
  expect_kept({{500, Kind::take_over, 1}, {506, Kind::vio_drift, 41, -0.44, 0.16, -1.43}, {512, Kind::operate, 19}});
  expect_kept({{500, Kind::take_over, 1}, {505, Kind::vio_shift, 65, 0, -0.48, 0.13}, {540, Kind::operate, 90}});
}

// A hold is a stop as well: it held its place in the map, and flew 0.24 m there by itself.
TEST_F(Regression, AfterAHoldAtRestALoopClosureMovesNothing) {
  DaemonRig rig({{413, Kind::closure, 1, -0.203, 0.134, 0.253, 0},
                 {419, Kind::operate, 57, 0.363, 0.727, 0.02},
                 {528, Kind::operate, 58, 0.752, 0.158, 0.73},
                 {699, Kind::operate, 17, 0.858, 0.236, 0.383},
                 {836, Kind::closure, 1, -0.019, -0.037, 0.006, 0.0986}},
                daemon::test::Medium::udp);
  const auto violation = rig.run(1000);
  EXPECT_FALSE(violation) << "tick " << violation->tick << ": " << violation->what;
}

}  // namespace
}  // namespace backwash::fuzz

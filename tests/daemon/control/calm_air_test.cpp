// SPDX-License-Identifier: BSD-3-Clause
// Sets that shrink in a verified stop where the air is shown to be calmer (docs/model.md 7-12): the control thread's
// part, tick by tick.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <optional>
#include <vector>

#include "core/log/raw/air_log.hpp"
#include "core/log/raw/tick_log.hpp"
#include "core/plan/rest.hpp"
#include "tests/daemon/lockstep/air_rig.hpp"

namespace backwash::daemon::test {
namespace {

constexpr double kCalmest = 0.4;

/// Hovers in the bench's air at a twentieth of its variance until sets shrink, or for four minutes.
struct CalmAir : testing::Test {
  static void SetUpTestSuite() {
    rig_ = new LearningRig(0.05, 1, learning(kCalmest));
    rig_->take_off();
    rig_->start_route(2);
    for (int n = 0; n < 12000 && !shrank(); ++n) {
      const bool rested = rig_->view().finished;
      rig_->tick();
      while (const auto event = rig_->channels->events.pop())
        if (event->kind == ControlEvent::Kind::calmer) told_ = event;
      if (shrank()) at_rest_ = rested;
    }
    shrank_tick_ = rig_->view().ticks;
    rig_->ticks(100);
  }
  static void TearDownTestSuite() { delete rig_; }
  static bool shrank() { return *std::ranges::min_element(rig_->view().air->factors) < 1; }
  static LearningRig* rig_;
  static bool at_rest_;
  static std::optional<ControlEvent> told_;
  static std::uint64_t shrank_tick_;
};
LearningRig* CalmAir::rig_ = nullptr;
bool CalmAir::at_rest_ = false;
std::optional<ControlEvent> CalmAir::told_;
std::uint64_t CalmAir::shrank_tick_ = 0;

TEST_F(CalmAir, IsHandedOverShownAndToldAtRestAndNotKeptOverARestart) {
  ASSERT_TRUE(shrank());
  EXPECT_TRUE(at_rest_);
  EXPECT_GE(*std::ranges::min_element(rig_->view().air->factors), kCalmest);
  const auto handed = rig_->channels->air.read_new();
  ASSERT_TRUE(handed);
  EXPECT_EQ(handed->factors, rig_->view().air->factors);
  EXPECT_GE(handed->falls, 1u) << "the map worker takes larger factors alone unless it is told of a fall";
  EXPECT_EQ(rig_->channels->air_kept.read_new(), kModelledAir);
  ASSERT_TRUE(told_);
  EXPECT_LT(told_->factor, 1);
}

TEST_F(CalmAir, IsDecidedAgainByAReplayBitForBit) {
  const std::string path = testing::TempDir() + "calm_" + std::to_string(::getpid()) + ".bwlog";
  rig_->save(path);
  auto log = log::read_raw_log(path).value();
  std::remove(path.c_str());
  const auto replayed = log::replay(log, "log");
  ASSERT_TRUE(replayed) << replayed.error().message;
  EXPECT_EQ(replayed->differing, 0u) << replayed->first->field << " of tick " << replayed->first->tick;
  // A log that does not say how far sets may shrink is one of a flight in which none did.
  for (auto& record : log.records)
    if (record.header.kind == log::RecordKind::air_constants) record.bytes.resize(sizeof(log::AirConstantsRecord));
  const auto other = log::replay(log, "log");
  ASSERT_TRUE(other && other->first);
  EXPECT_EQ(other->first->field, "factors");
  EXPECT_EQ(other->first->tick, shrank_tick_ - 1);
}

TEST_F(CalmAir, ShrinksNothingBeforeTheLastCommandOfASegment) {
  LearningRig rig(0.05, 1, learning(kCalmest));
  rig.take_off();
  const auto ticks = static_cast<int>(shrank_tick_);
  rig.offer(std::vector<Setpoint>(shrank_tick_, rig.view().command));
  rig.ticks(ticks - 10);
  EXPECT_FALSE(rig.view().finished);
  EXPECT_EQ(rig.view().air->factors, kModelledAir);
  rig.ticks(60);
  EXPECT_TRUE(rig.view().finished);
  EXPECT_NE(rig.view().air->factors, kModelledAir) << "at rest it is done at once";
}

TEST_F(CalmAir, EndsWithTheFlightAndIsShownAnewInTheNext) {
  LearningRig rig(0.05, 1, learning(kCalmest));
  rig.take_off();
  rig.start_route(2);
  rig.ticks(static_cast<int>(shrank_tick_));
  ASSERT_NE(rig.view().air->factors, kModelledAir);
  const std::uint64_t falls = rig.channels->air.read_new().value().falls;
  rig.in_hand().disarm();
  rig.ticks(50);
  EXPECT_EQ(rig.view().air->factors, kModelledAir);
  const auto handed = rig.channels->air.read_new();
  ASSERT_TRUE(handed);
  EXPECT_EQ(handed->factors, kModelledAir);
  EXPECT_EQ(handed->falls, falls);
}

// The planner asks before it verifies, and the air may have changed since.
TEST_F(CalmAir, ASegmentOfCalmerAirThanThereIsIsRefusedInTheTick) {
  LearningRig rig(1);
  rig.take_off();
  const std::uint64_t flown = rig.view().segment;
  for (std::size_t k = 0; k < kAirClasses; ++k) {
    rig.sets_of = kModelledAir;
    rig.sets_of[k] = 0.99;
    const std::uint64_t id = rig.offer(std::vector<Setpoint>(50, rig.view().command));
    rig.tick();
    EXPECT_EQ(rig.view().refused_segment, id);
    EXPECT_EQ(rig.view().segment, flown);
  }
  rig.sets_of = {1, 1.5, 1, 1, 1};
  const std::uint64_t id = rig.offer(std::vector<Setpoint>(50, rig.view().command));
  rig.tick();
  EXPECT_EQ(rig.view().segment, id);
}

// Of rougher air too: a new way is flown by sets of the air as it is known now, to the step of a world made anew.
TEST_F(CalmAir, ASegmentOfSmootherAirThanIsKnownIsRefusedInTheTickUnlessItContinuesAFlight) {
  auto learns = learning();
  learns.start = {1, 1.5, 1, 1, 1.2};
  LearningRig rig(1, 1, learns);
  rig.sets_of = learns.start;
  rig.take_off();
  const std::uint64_t flown = rig.view().segment;
  const std::vector<Setpoint> here(50, rig.view().command);
  for (const AirFactors& made : {kModelledAir, AirFactors{1, 1.42, 1, 1, 1.2}, AirFactors{2, 2, 2, 2, 1.1}}) {
    rig.sets_of = made;
    const std::uint64_t id = rig.offer(here);
    rig.tick();
    EXPECT_EQ(rig.view().refused_segment, id);
    EXPECT_EQ(rig.view().segment, flown);
  }
  rig.sets_of = {1, 1.45, 1, 1, 1.2};
  const std::uint64_t id = rig.offer(here);
  rig.tick();
  EXPECT_EQ(rig.view().segment, id);
  track::AcceptedSegment on;  // as it slows down, or is led back
  on.id = id + 1;
  on.continues = id;
  on.branch = rig.view().index;
  on.closures = rig.view().closures;
  on.epoch = rig.view().epoch;
  on.commands = here;
  on.tube = plan::tube_to_rest(rig.world(), rig.view().state, here[0], here);
  rig.channels->segments.offer(std::make_unique<const track::AcceptedSegment>(on));
  rig.tick();
  EXPECT_EQ(rig.view().segment, on.id);
}

TEST_F(CalmAir, ShrinksNothingUnlessItIsConfigured) {
  LearningRig rig(0.05);
  rig.take_off();
  rig.start_route(2);
  rig.ticks(static_cast<int>(shrank_tick_));
  EXPECT_EQ(rig.view().air->factors, kModelledAir);
}

}  // namespace
}  // namespace backwash::daemon::test

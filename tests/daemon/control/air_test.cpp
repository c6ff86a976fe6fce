// SPDX-License-Identifier: BSD-3-Clause
// What the control thread learns of its air, tick by tick, and what the raw log says of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "core/log/raw/air_log.hpp"
#include "core/log/raw/tick_log.hpp"
#include "services/dds/air_text.hpp"
#include "tests/daemon/lockstep/air_rig.hpp"

namespace backwash::daemon::test {
namespace {

using log::RecordKind;

std::vector<log::RawRecord> of_kind(const Lockstep& rig, RecordKind kind) {
  std::vector<log::RawRecord> found;
  std::ranges::copy_if(rig.log, std::back_inserter(found), [&](const auto& r) { return r.header.kind == kind; });
  return found;
}
log::RawLog saved(const Lockstep& rig) {
  const std::string path = testing::TempDir() + "air_" + std::to_string(::getpid()) + ".bwlog";
  rig.save(path);
  auto log = log::read_raw_log(path).value();
  std::remove(path.c_str());
  return log;
}

class LearnsInFlight : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    rig_ = new LearningRig(8);
    rig_->take_off();
    rig_->start_route(2);
    rig_->ticks(1500);
  }
  static void TearDownTestSuite() { delete rig_; }
  static LearningRig* rig_;
};
LearningRig* LearnsInFlight::rig_ = nullptr;

TEST_F(LearnsInFlight, RougherAirIsHandedOverShownAndTold) {
  ASSERT_TRUE(rig_->view().air);
  EXPECT_GT(rig_->largest_factor(), 1.1);
  const auto handed = rig_->channels->air.read_new();
  const auto kept = rig_->channels->air_kept.read_new();
  ASSERT_TRUE(handed && kept);
  EXPECT_EQ(handed->factors, rig_->view().air->factors);
  EXPECT_EQ(*kept, kModelledAir) << "of a flight that has not ended";
  double told = 0;
  while (const auto event = rig_->channels->events.pop())
    if (event->kind == ControlEvent::Kind::rougher) {
      EXPECT_EQ(event->factor, std::max(event->factor, told));
      told = std::max(told, event->factor);
      EXPECT_GT(event->ln_evidence, 1) << "a bet that lost is no evidence";
    }
  EXPECT_EQ(told, rig_->largest_factor());
}

TEST_F(LearnsInFlight, FactorsInTheRawLogOnlyGrow) {
  AirFactors before = kModelledAir;
  const auto records = of_kind(*rig_, RecordKind::air);
  ASSERT_GT(records.size(), 1600u);
  for (const auto& record : records) {
    const auto& r = *log::payload<log::AirRecord>(record);
    for (std::size_t k = 0; k < kAirClasses; ++k) EXPECT_GE(r.factors[k], before[k]) << r.tick;
    std::ranges::copy(r.factors, before.begin());
    EXPECT_GT(r.sigma[0], 0);
  }
  EXPECT_EQ(before, rig_->view().air->factors);
}

TEST_F(LearnsInFlight, NothingIsAddedOnTheGround) {
  const auto records = of_kind(*rig_, RecordKind::air);
  std::int64_t lifted = 0;
  for (const auto& record : of_kind(*rig_, RecordKind::tick))
    if (lifted == 0 && log::payload<log::TickRecord>(record)->mode == static_cast<std::uint32_t>(Mode::lifting))
      lifted = record.header.t_ns;
  ASSERT_GT(lifted, 0);
  EXPECT_GT(records.front().header.t_ns, lifted);
}

TEST_F(LearnsInFlight, AReplayDecidesEveryUpdateAgainBitForBit) {
  const auto log = saved(*rig_);
  const auto replayed = log::replay(log, "log");
  ASSERT_TRUE(replayed) << replayed.error().message;
  EXPECT_EQ(replayed->differing, 0u) << replayed->first->field << " of tick " << replayed->first->tick;
  EXPECT_EQ(log::replay(log, "log")->state_hash, replayed->state_hash);
}

/// Changes a member of the nth record of the air.
template <typename Change>
log::RawLog changed(const Lockstep& rig, std::size_t n, const Change& change) {
  auto log = saved(rig);
  for (auto& record : log.records)
    if (record.header.kind == RecordKind::air && n-- == 0)
      change(*reinterpret_cast<log::AirRecord*>(record.bytes.data()));
  return log;
}

TEST_F(LearnsInFlight, AReplayNamesTheUpdateThatTheLogTellsOtherwise) {
  const auto first = [&](std::size_t n, const auto& change) {
    const auto replayed = log::replay(changed(*rig_, n, change), "log");
    return replayed && replayed->first ? replayed->first->field : replayed ? "" : replayed.error().message;
  };
  EXPECT_EQ(first(300, [](auto& r) { r.factors[2] *= 1.0000001; }), "factors");
  EXPECT_EQ(first(300, [](auto& r) { r.ln_evidence += 1e-12; }), "ln_evidence");
  EXPECT_EQ(first(300, [](auto& r) { r.sigma[0] *= 1.001; }), "ln_evidence") << "an input changes what follows";
  auto lost = saved(*rig_);
  std::size_t n = 0;
  std::erase_if(lost.records, [&](const auto& r) { return r.header.kind == RecordKind::air && n++ == 300; });
  const auto without = log::replay(lost, "log");
  ASSERT_TRUE(without && without->first);
  EXPECT_EQ(without->first->field, "air");
}

TEST_F(LearnsInFlight, ADamagedStartOrRecordIsNamedByItsByte) {
  auto log = saved(*rig_);
  const auto start = std::ranges::find(log.records, RecordKind::air_constants, [](auto& r) { return r.header.kind; });
  ASSERT_NE(start, log.records.end());
  const std::string at = "log: byte " + std::to_string(start->offset) + ": ";
  for (const double bad : {std::nan(""), 0.0, -1.0, HUGE_VAL}) {
    auto damaged = log;
    auto& record = damaged.records[static_cast<std::size_t>(start - log.records.begin())];
    reinterpret_cast<log::AirConstantsRecord*>(record.bytes.data())->tau_high = bad;
    const auto replayed = log::replay(damaged, "log");
    ASSERT_FALSE(replayed) << bad;
    EXPECT_NE(replayed.error().message.find(at), std::string::npos) << replayed.error().message;
  }
  std::erase_if(log.records, [](const auto& r) { return r.header.kind == RecordKind::air_constants; });
  EXPECT_FALSE(log::replay(log, "log"));
}

TEST(LearnsNothing, UnlessItIsToldTo) {
  LearningRig rig(4, 1, std::nullopt);
  rig.take_off();
  rig.start_route(2);
  rig.ticks(300);
  EXPECT_FALSE(rig.view().air);
  EXPECT_FALSE(rig.channels->air.read_new());
  EXPECT_TRUE(of_kind(rig, RecordKind::air).empty());
  EXPECT_TRUE(of_kind(rig, RecordKind::air_constants).empty());
  EXPECT_EQ(log::replay(saved(rig), "log")->differing, 0u);
}

// The bench's air is none of the model's forms; as modelled it is calmer than the model at most places.
TEST(LearnsInFlightOfTheBench, AirAsModelledIsNotCalledRougher) {
  int told = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    LearningRig rig(1, seed);
    rig.take_off();
    rig.start_route(2);
    rig.ticks(800);
    told += rig.largest_factor() > 1;
  }
  EXPECT_EQ(told, 0);
}

// Samples come in every third tick alone; the set-points of the others count too.
TEST(LearnsInFlightOfTheBench, OdometryThatMissesTicksIsReplayedToo) {
  LearningRig rig(4);
  rig.take_off();
  rig.start_route(1);
  int n = 0;
  for (int k = 0; k < 150; ++k) {
    rig.vio_on = n++ % 3 == 0;  // 16.7 Hz: as slow as odometry may be that is not stated to be slower
    rig.tick();
  }
  EXPECT_EQ(log::replay(saved(rig), "log")->differing, 0u);
  const auto records = of_kind(rig, RecordKind::air);
  EXPECT_GT(records.size(), 200u);
  std::size_t of_last = 0;
  for (const auto& record : records) of_last += record.header.t_ns > rig.now_ns() - 150 * 20'000'000LL;
  EXPECT_EQ(of_last, 150u);
}

std::vector<log::AirOrderRecord> orders_of(const Lockstep& rig) {
  std::vector<log::AirOrderRecord> orders;
  for (const auto& record : of_kind(rig, RecordKind::air_order))
    orders.push_back(*log::payload<log::AirOrderRecord>(record));
  return orders;
}

/// Frozen before take-off, in air in which factors grow within the flight; then as the test has it.
struct OrdersAboutTheAir : testing::Test {
  OrdersAboutTheAir() {
    ask(adapt::AirOrder::freeze);
    rig.take_off();
    rig.start_route(2);
    rig.ticks(1500);
  }
  void ask(adapt::AirOrder order) {
    EXPECT_TRUE(rig.channels->air_orders.push(order));
    rig.tick();
  }
  LearningRig rig{8};
};

TEST_F(OrdersAboutTheAir, FrozenFactorsStayWhileEvidenceIsCountedAndThawedOnesFollowItAtOnce) {
  EXPECT_TRUE(rig.view().air->frozen);
  EXPECT_EQ(rig.largest_factor(), 1);
  EXPECT_FALSE(rig.channels->air.read_new());
  EXPECT_GT(*std::ranges::max_element(rig.view().air->ln_evidence), 1);
  ask(adapt::AirOrder::thaw);
  EXPECT_FALSE(rig.view().air->frozen);
  EXPECT_GT(rig.largest_factor(), 1.1) << "what was learnt meanwhile";
  const auto handed = rig.channels->air.read_new();
  ASSERT_TRUE(handed);
  EXPECT_EQ(handed->factors, rig.view().air->factors);
  EXPECT_EQ(rig.channels->air_kept.read_new(), kModelledAir);
}

TEST_F(OrdersAboutTheAir, AResetOfAnArmedVehicleIsNotDoneAndTold) {
  ask(adapt::AirOrder::thaw);
  const AirFactors before = rig.view().air->factors;
  ask(adapt::AirOrder::reset);
  EXPECT_EQ(rig.view().air->factors, before);
  EXPECT_EQ(orders_of(rig).back().done, 0u);
  int told = 0;
  while (const auto event = rig.channels->events.pop()) told += event->kind == ControlEvent::Kind::air_kept;
  EXPECT_EQ(told, 1);
}

TEST_F(OrdersAboutTheAir, AResetOfADisarmedOneForgetsFactorsAndEvidenceAndIsHandedOverAsOne) {
  ask(adapt::AirOrder::thaw);
  ASSERT_GT(rig.largest_factor(), 1);
  rig.in_hand().disarm();
  rig.ticks(100);
  const AirFactors kept = rig.channels->air_kept.read_new().value();
  EXPECT_EQ(rig.view().air->factors, kept) << "of a flight that ended";
  ask(adapt::AirOrder::reset);
  EXPECT_EQ(rig.view().air->factors, kModelledAir);
  EXPECT_EQ(*std::ranges::max_element(rig.view().air->ln_evidence), 0);
  EXPECT_EQ(*std::ranges::max_element(rig.view().air->seconds), 0);
  const auto handed = rig.channels->air.read_new();
  ASSERT_TRUE(handed);
  EXPECT_EQ(handed->factors, kModelledAir);
  EXPECT_GE(handed->falls, 1u);
  EXPECT_EQ(rig.channels->air_kept.read_new().value_or(kept), kModelledAir) << "a restart begins with it";
}

TEST_F(OrdersAboutTheAir, AReplayDecidesThemAgainAndNamesOneThatTheLogTellsOtherwise) {
  ask(adapt::AirOrder::thaw);
  rig.ticks(50);
  ask(adapt::AirOrder::reset);
  rig.in_hand().disarm();
  rig.ticks(100);
  ask(adapt::AirOrder::reset);
  const auto orders = orders_of(rig);
  ASSERT_EQ(orders.size(), 4u);
  EXPECT_EQ(orders[2].done, 0u);
  EXPECT_EQ(orders[3].done, 1u);
  const auto log = saved(rig);
  const auto replayed = log::replay(log, "log");
  ASSERT_TRUE(replayed) << replayed.error().message;
  EXPECT_EQ(replayed->differing, 0u) << replayed->first->field << " of tick " << replayed->first->tick;
  const auto first = [&](std::size_t n, const auto& change) {
    auto told = log;
    for (auto& record : told.records)
      if (record.header.kind == RecordKind::air_order && n-- == 0)
        change(*reinterpret_cast<log::AirOrderRecord*>(record.bytes.data()));
    const auto again = log::replay(told, "log");
    return again && again->first ? again->first->field : again ? "" : again.error().message;
  };
  EXPECT_EQ(first(2, [](auto& r) { r.done = 1; }), "done");
  EXPECT_EQ(first(3, [](auto& r) { r.factors[1] = 1.5; }), "factors");
  EXPECT_EQ(first(0, [](auto& r) { r.order = 2; }), "frozen") << "thawed instead: the next tick differs";
  EXPECT_NE(first(1, [](auto& r) { r.order = 3; }).find("is no order about the air"), std::string::npos);
}

TEST(AirText, SaysWhatItIsToldToTheDigitsThatItHas) {
  const dds::AirSaid air{true, {{"ground", 1.4142, 8.24, 33.6, "motion"}, {"none", 1, 0, 2}}};
  EXPECT_EQ(dds::to_text(air), "frozen: ground 1.41 by motion (8.2, 34 s), none 1.00 (0.0, 2 s)");
  const auto said = dds::air_said(dds::to_text(air));
  ASSERT_TRUE(said && said->classes.size() == 2);
  EXPECT_TRUE(said->frozen);
  EXPECT_EQ(said->classes[0].name, "ground");
  EXPECT_EQ(said->classes[0].factor, 1.41);
  EXPECT_EQ(said->classes[0].ln_evidence, 8.2);
  EXPECT_EQ(said->classes[0].seconds, 34);
  EXPECT_EQ(said->classes[0].cause, "motion");
  EXPECT_EQ(said->classes[1].cause, "");
  EXPECT_EQ(dds::to_text(*said), dds::to_text(air));
  EXPECT_EQ(dds::to_text({}), "as modelled");
  ASSERT_TRUE(dds::air_said("as modelled"));
  EXPECT_TRUE(dds::air_said("as modelled")->classes.empty());
  for (const char* other : {"", "frozen: ", "ground 1.41 (8.2)", "ground 1.41 (8.2, 34 s) and more",
                            "ground 1.41 by (8.2, 34 s)", "anything"})
    EXPECT_FALSE(dds::air_said(other)) << other;
}

// Of which samples a flight learns of its air.

// A closure turns and moves state and set-point, and no air: what it did between two samples is no gust.
TEST(LearnsOfSamples, FromASampleThatALoopClosureMovedItBeginsAnew) {
  LearningRig rig(1);
  track::RigidShift D;
  std::uint32_t closures = 1;  // the identity
  rig.reader = [&](const OdometrySample& in) {
    OdometrySample s = track::moved(D, in);
    s.closures = closures;
    s.map_from_odom = D;
    return std::optional(s);
  };
  rig.take_off();
  rig.start_route(2);
  const auto seconds = [&rig] {
    double all = 0;
    for (const double of_class : rig.view().air->seconds) all += of_class;
    return all;
  };
  const double before = seconds();
  rig.ticks(200);
  EXPECT_GT(seconds(), before) << "it goes on";
  const Vec3 here = rig.view().state.p_W;
  const track::RigidShift turn{5 * kDegree, Vec3::Zero()};
  D = {turn.yaw, here - turn.rotate(here)};
  ++closures;
  rig.tick();
  const double then = seconds();
  rig.ticks(60);
  ASSERT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
  EXPECT_EQ(seconds(), then);
  rig.ticks(300);
  EXPECT_GT(seconds(), then);
}

// Neither is it of the air what motors do on the ground, nor what nobody says where it was.
TEST(LearnsOfSamples, NothingOfAVehicleThatIsNotKnownToFly) {
  track::TickInput in;
  track::TickOutput out;
  in.autopilot.armed = out.supervisor.send_setpoint = true;
  out.supervisor.mode = Mode::tracking;
  EXPECT_FALSE(log::flown(in, out));
  out.landed = true;
  EXPECT_FALSE(log::flown(in, out));
  out.landed = false;
  EXPECT_TRUE(log::flown(in, out));
  out.supervisor.send_setpoint = false;
  EXPECT_FALSE(log::flown(in, out)) << "nothing is flown";
}

}  // namespace
}  // namespace backwash::daemon::test

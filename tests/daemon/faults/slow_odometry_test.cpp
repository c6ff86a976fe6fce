// SPDX-License-Identifier: BSD-3-Clause
// Rows 1, 16, 49 and 53 of docs/faults.md for odometry that comes seldom or late, as it was stated (docs/model.md 4-13
// to 4-15).
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <random>

#include "core/log/raw/tick_log.hpp"
#include "core/plan/planner.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

/// An estimator that takes a pose every `every` ticks and says it `late` ticks later, at random up to `jitter` more.
struct Estimator {
  int every = 5, late = 0, jitter = 0;
};

class SlowVio {
 public:
  explicit SlowVio(const Estimator& e) : e_(e) {}
  std::optional<OdometrySample> operator()(const OdometrySample& s) {
    if (tick_ % e_.every == 0 && speaks)
      on_the_way_.push_back({tick_ + e_.late + std::uniform_int_distribution(0, e_.jitter)(random_), s});
    ++tick_;
    if (on_the_way_.empty() || on_the_way_.front().due >= tick_) return std::nullopt;
    OdometrySample said = on_the_way_.front().sample;
    on_the_way_.pop_front();
    said.received_ns = s.received_ns;
    if (spoil) spoil(said);
    return said;
  }
  bool speaks = true;
  std::function<void(OdometrySample&)> spoil;

 private:
  struct Message {
    int due;
    OdometrySample sample;
  };
  Estimator e_;
  std::mt19937 random_{5};
  int tick_ = 0;
  std::deque<Message> on_the_way_;
};

constexpr OdometryTiming k10Hz{9, 0};

struct Rig : Lockstep {
  Rig(const Estimator& e, const OdometryTiming& timing)
      : Lockstep({0.7, Vec3(5, -3, 0.2)}, Medium::udp, corridor(), timing), vio(e) {
    reader = std::ref(vio);
    ticks(150);  // until the frames are known
  }
  SlowVio vio;
};

/// Of the raw log, decided again.
log::Replay replayed(const Lockstep& rig) {
  const std::string path = testing::TempDir() + "slow_" + std::to_string(::getpid()) + ".bwlog";
  rig.save(path);
  const auto replay = log::replay(log::read_raw_log(path).value(), path);
  std::filesystem::remove(path);
  EXPECT_TRUE(replay) << replay.error().message;
  return replay.value_or(log::Replay{});
}

/// The route's tube as it was offered last: half width across it where it begins to move and 0.2 s later, and the
/// clearance of the first second from there, m.
std::array<double, 3> cost(const Lockstep& rig) {
  std::unique_ptr<track::AcceptedSegment> route;
  for (const auto& r : rig.log)
    if (r.header.kind == log::RecordKind::offer) route = log::decode_offer(r.bytes).value();
  std::size_t moves = 0;
  while (route->commands[moves].v_W.isZero(0)) ++moves;
  const auto from = route->tube.begin() + static_cast<std::ptrdiff_t>(moves);
  return {from->half_widths[kY], (from + 10)->half_widths[kY], plan::tube_clearance(rig.world(), {from, from + 50})};
}

// Seldom, with jitter, late, and both: what was stated is flown by.
TEST(SlowOdometry, ARouteIsFlownWithEverySampleInsideAndReplaysBitForBit) {
  struct Case {
    Estimator estimator;
    OdometryTiming timing;
  };
  for (const auto& [estimator, timing] :
       {Case{{1, 0, 0}, {}}, Case{{2, 0, 0}, {}}, Case{{5, 0, 0}, k10Hz}, Case{{5, 0, 1}, k10Hz},
        Case{{5, 2, 1}, {9, 0.04}}, Case{{5, 6, 0}, {9, 0.12}}, Case{{1, 2, 0}, {20, 0.04}},
        Case{{1, 6, 0}, {20, 0.12}}, Case{{2, 6, 1}, {20, 0.12}}}) {
    const std::string what = "every " + std::to_string(estimator.every) + " ticks, " + std::to_string(estimator.late) +
                             " late, jitter " + std::to_string(estimator.jitter);
    Rig rig(estimator, timing);
    rig.take_off();
    rig.start_route(1);
    double fastest = 0;
    while (!rig.view().finished) {
      rig.tick();
      ASSERT_EQ(rig.mode(), Mode::tracking) << what << ": " << to_string(rig.reason());
      fastest = std::max(fastest, rig.autopilot->truth().v_W.norm());
    }
    EXPECT_GT(fastest, 0.8) << what;
    EXPECT_EQ(rig.view().shown.samples_outside, 0u) << what << ", of " << rig.view().shown.samples_inside;
    EXPECT_GT(rig.view().shown.samples_inside, static_cast<std::uint64_t>(200 / estimator.every)) << what;
    EXPECT_LT((rig.autopilot->truth().p_W - Vec3(2, 0, 1.2)).norm(), 0.15) << what;
    const log::Replay replay = replayed(rig);
    EXPECT_EQ(replay.differing, 0u) << what << ": " << (replay.first ? replay.first->field : "");
    EXPECT_EQ(replay.ticks, rig.view().ticks) << what;
    const auto [first, later, clearance] = cost(rig);
    std::printf("%s: %lu inside, %lu outside; half width %.4f m, 0.2 s later %.4f m; clearance %.4f m\n", what.c_str(),
                rig.view().shown.samples_inside, rig.view().shown.samples_outside, first, later, clearance);
  }
}

// Else the test above could not fail.
TEST(SlowOdometry, ALatencyThatWasNotStatedLeavesTheSets) {
  Rig rig({1, 6, 0}, {});
  rig.take_off();
  rig.start_route(0.2);
  for (int n = 0; n < 150 && rig.mode() == Mode::tracking; ++n) rig.tick();
  EXPECT_EQ(rig.mode(), Mode::hold);
  EXPECT_EQ(rig.reason(), Reason::outside_set) << to_string(rig.reason());
}

TEST(SlowOdometry, OfEightHertzThatWereNotStatedAGapIsAHold) {
  Lockstep rig;
  rig.take_off();
  SlowVio vio({6, 0, 0});
  rig.reader = std::ref(vio);
  for (int n = 0; n < 20 && rig.mode() == Mode::tracking; ++n) rig.tick();
  EXPECT_EQ(rig.reason(), Reason::odometry_lost) << to_string(rig.reason());
}

TEST(SlowOdometry, ASilenceIsAHoldOneLongerGapLaterAndNoMore) {
  Rig rig({5, 0, 0}, k10Hz);
  rig.take_off();
  rig.start_route(2);
  const double more_ms = 1e3 * k10Hz.longer_gap();
  std::int64_t last_ns = 0;
  rig.vio.spoil = [&](OdometrySample& s) { last_ns = s.received_ns; };
  for (int n = 0; n < 5; ++n) rig.tick();
  rig.vio.speaks = false;
  const auto since = [&] { return static_cast<double>(rig.now_ns() - last_ns) * 1e-6; };
  while (rig.mode() == Mode::tracking && since() < 500) rig.tick();
  EXPECT_EQ(rig.reason(), Reason::odometry_lost) << to_string(rig.reason());
  EXPECT_GT(since(), 80 + more_ms);
  EXPECT_LE(since(), 100 + more_ms);
  while (rig.mode() == Mode::hold && since() < 1000) rig.tick();
  EXPECT_EQ(rig.mode(), Mode::land);
  EXPECT_LE(since(), 400 + more_ms);
}

TEST(SlowOdometry, AJumpIsHeldInItsTick) {
  Rig rig({5, 0, 0}, k10Hz);
  rig.take_off();
  rig.start_route(2);
  bool jumped = false;
  rig.vio.spoil = [&](OdometrySample& s) {
    s.state.p_W.y() += 0.3;
    jumped = true;
  };
  while (!jumped) rig.tick();
  EXPECT_EQ(rig.mode(), Mode::hold);
  EXPECT_EQ(rig.reason(), Reason::odometry_jump) << to_string(rig.reason());
}

// At 10 Hz no three ticks in a row have a sample of their own.
TEST(SlowOdometry, AnErrorOutsideItsSetIsAHoldTwoTicksAfterItsSample) {
  Rig rig({5, 0, 0}, k10Hz);
  rig.take_off();
  rig.start_route(2);
  // No jump, no contradiction: the twist tells of the way.
  rig.vio.spoil = [&](OdometrySample& s) { s.state.p_W.y() += 0.08, s.state.v_W.y() += 1.5; };
  const std::uint64_t before = rig.view().shown.samples_outside;
  int n = 0;
  for (; n < 6 && rig.view().shown.samples_outside == before; ++n) rig.tick();
  ASSERT_EQ(rig.view().shown.samples_outside, before + 1);
  EXPECT_EQ(rig.ticks_until(Mode::hold, 4), 2);
  EXPECT_EQ(rig.reason(), Reason::outside_set) << to_string(rig.reason());
}

TEST(SlowOdometry, TheLogSaysTheTimingThatItWasDecidedBy) {
  Lockstep rig;
  rig.ticks(2);
  Rig slow({5, 0, 0}, k10Hz);
  const auto timing = [](const Lockstep& of) {
    for (const auto& r : of.log)
      if (const auto* c = log::payload<log::DriftConstantsRecord>(r); r.header.kind == log::RecordKind::constants && c)
        return OdometryTiming{c->timed.rate_least, c->timed.latency};
    return OdometryTiming{0, 0};
  };
  EXPECT_TRUE(timing(rig).usual());
  EXPECT_EQ(timing(slow).rate_least, k10Hz.rate_least);
}

}  // namespace
}  // namespace backwash::daemon::test

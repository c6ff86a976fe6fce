// SPDX-License-Identifier: BSD-3-Clause
// STOP while a plan is under way (docs/faults.md rows 39 and 40): real mission, planner, control loop and emulated
// autopilot in one thread. While the planner waits ticks pass; while it computes, none do.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "core/map/octomap/octomap_message.hpp"
#include "services/backwashd/plan/mission.hpp"
#include "services/backwashd/plan/planner_worker.hpp"
#include "services/dds/topics.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

constexpr std::uint8_t kAccepted = backwash_msgs_msg_dds__ACK_ACCEPTED, kRefused = backwash_msgs_msg_dds__ACK_REFUSED;
constexpr std::uint8_t kEnable = backwash_msgs_msg_dds__COMMAND_ENABLE,
                       kTakeoff = backwash_msgs_msg_dds__COMMAND_TAKEOFF, kGoto = backwash_msgs_msg_dds__COMMAND_GOTO,
                       kHold = backwash_msgs_msg_dds__COMMAND_HOLD, kLand = backwash_msgs_msg_dds__COMMAND_LAND,
                       kStop = backwash_msgs_msg_dds__COMMAND_STOP;

struct Flight {
  std::string log_ = std::filesystem::temp_directory_path() / ("backwash_stop." + std::to_string(getpid()));
  Lockstep rig_;
  Recorder recorder_{log_};
  Mission mission_{vehicle_5in()};
  int pauses_ = 0, stop_after_ = -1;  // the planner's pauses until STOP is given; −1: never
  PlannerWorker planner_{*rig_.channels, recorder_, [](const auto&) {}, [this] { pause(); }};
  std::uint32_t sequence_ = 0;
  int armed_commands_ = 0;
  std::string said_;  // the last answer

  ~Flight() { std::filesystem::remove(log_); }

  void pause() {
    if (pauses_++ == stop_after_) {
      EXPECT_EQ(give(kStop), kAccepted);
    }
    tick();
  }
  void tick() {
    for (const auto& c : rig_.tick().commands) armed_commands_ += c.command == kCommandArm && c.param1 == 1;
    look();
  }
  void ticks(int count) {
    for (int n = 0; n < count; ++n) tick();
  }
  void look() {
    MissionInput in;
    in.now_s = static_cast<double>(rig_.now_ns()) * 1e-9;
    in.view = rig_.channels->view_mission.read_new();
    if (const auto* world = rig_.channels->worlds.mission.take()) {
      in.world = world->world;
      rig_.channels->worlds.mission.give_back(world);
    }
    std::vector<PlanOutcome> outcomes;
    while (const auto outcome = rig_.channels->outcomes.pop()) outcomes.push_back(*outcome);
    in.outcomes = outcomes;
    carry_out(mission_.observe(in));
  }
  void carry_out(const Decision& d) {
    if (d.order) {
      ASSERT_TRUE(rig_.channels->orders.push(*d.order));
    }
    if (d.job) rig_.channels->jobs.offer(std::make_unique<const PlanJob>(*d.job));
  }
  std::uint8_t give(std::uint8_t verb, const Vec3& position = {2, 0, 1.2}) {
    CommandMessage c;
    c.station[0] = 'g';
    c.session = 1;
    c.sequence = ++sequence_;
    c.verb = verb;
    c.position = position;
    const Decision d = mission_.handle(c, static_cast<double>(rig_.now_ns()) * 1e-9);
    carry_out(d);
    said_ = d.answer->reason;
    return d.answer->result;
  }
  void rises() {
    rig_.take_off();
    look();
  }
  /// From here on the set-point may roll out on a verified stop, and no farther.
  void expect_rest(double farthest) {
    const Vec3 from = rig_.view().command.p_W;
    Vec3 last = from;
    for (int n = 0; n < 400; ++n) {
      planner_.step();
      tick();
      if (n >= 200) {
        EXPECT_EQ(rig_.view().command.p_W, last) << n;
      }
      last = rig_.view().command.p_W;
    }
    EXPECT_LE((last - from).norm(), farthest);
    EXPECT_NE(rig_.mode(), Mode::tracking);
  }
};

TEST(StopWhilePlanning, AStopBeforeAndWhileAndAfterThePlanIsOfferedEndsItEveryTime) {
  Flight f;
  f.rises();
  for (const int after : {-1, 0, 1, 2, 5}) {
    f.stop_after_ = after;
    f.pauses_ = 0;
    ASSERT_EQ(f.give(kGoto, {f.rig_.view().command.p_W.x() > 0 ? -2.0 : 2.0, 0, 1.2}), kAccepted) << after;
    if (after < 0) {
      EXPECT_EQ(f.give(kStop), kAccepted);
    }                   // before the planner has looked
    f.planner_.step();  // plans, offers, waits for the answer
    if (after >= f.pauses_) {
      f.ticks(10);
      EXPECT_EQ(f.give(kStop), kAccepted);
    }
    f.tick();
    EXPECT_EQ(f.rig_.mode(), Mode::hold) << after;
    EXPECT_EQ(f.rig_.reason(), Reason::stop_requested) << after;
    f.expect_rest(0.6);
  }
}

// It used to go on for two seconds.
TEST(StopWhilePlanning, AStopEndsThePatienceOfAFlightIntoTheUnknown) {
  Flight f;
  f.rises();
  map::OccupancyGrid known = f.rig_.world().grid;
  for (int k = 0; k < known.size().z(); ++k)
    for (int j = 0; j < known.size().y(); ++j)
      for (int i = 0; i < known.size().x(); ++i)
        if (known.center({i, j, k}).x() > f.rig_.view().command.p_W.x() + 0.35)
          known.set({i, j, k}, map::Cell::unknown);
  f.rig_.channels->worlds.offer({plan::build_world(std::move(known), Model{}, vehicle_5in()), f.rig_.now_ns()});
  f.look();
  ASSERT_EQ(f.give(kGoto, {1.8, 0, 1.2}), kAccepted);
  f.stop_after_ = 3;
  f.planner_.step();
  EXPECT_GT(f.pauses_, 3) << "there was something to stop";
  EXPECT_LE(f.pauses_, 6);
  f.expect_rest(0.01);
}

TEST(StopWhilePlanning, AHoldEndsTheFlightThatWasPlannedBeforeItAndALaterGotoFlies) {
  Flight f;
  f.rises();
  ASSERT_EQ(f.give(kGoto), kAccepted);
  EXPECT_EQ(f.give(kHold), kAccepted);
  f.planner_.step();
  const Vec3 here = f.rig_.view().command.p_W;
  f.ticks(100);
  EXPECT_EQ(f.rig_.view().command.p_W, here);
  ASSERT_EQ(f.give(kGoto), kAccepted);
  f.planner_.step();
  f.ticks(50);
  EXPECT_NE(f.rig_.view().command.p_W, here);
  EXPECT_EQ(f.rig_.mode(), Mode::tracking);
}

// As a real autopilot did it after a restart: its estimate was reset once more just after it had been taken in hand.
TEST(OnTheGround, AHoldThereSaysThatLandEndsItAndSoItDoes) {
  Flight f;
  f.ticks(60);
  ASSERT_EQ(f.give(kEnable), kAccepted);
  for (int n = 0; n < 250 && f.rig_.mode() != Mode::tracking; ++n) f.tick();
  f.rig_.local_frame.origin += Vec3(0.4, 0, 0);
  f.rig_.in_hand().reset_estimator(f.rig_.local_frame);
  f.ticks(50);
  ASSERT_EQ(f.rig_.mode(), Mode::hold);
  ASSERT_EQ(f.rig_.reason(), Reason::autopilot_reset);
  EXPECT_EQ(f.give(kEnable), kRefused);
  EXPECT_EQ(f.said_, "already hold (autopilot's position estimate was reset): land ends it, then enable");
  EXPECT_EQ(f.give(kLand), kAccepted);
  for (int n = 0; n < 250 && f.rig_.mode() != Mode::passive; ++n) f.tick();
  EXPECT_EQ(f.rig_.mode(), Mode::passive);
  ASSERT_EQ(f.give(kEnable), kAccepted) << f.said_;
  for (int n = 0; n < 250 && f.rig_.mode() != Mode::tracking; ++n) f.tick();
  EXPECT_EQ(f.rig_.mode(), Mode::tracking);
}

// Row 40.
TEST(StopWhilePlanning, ATakeoffThatWasStoppedArmsNothingNeitherNowNorAtTheNextEnable) {
  for (const int after : {-1, 0, 1}) {
    SCOPED_TRACE(after);
    Flight f;
    f.ticks(60);
    ASSERT_EQ(f.give(kEnable), kAccepted);
    for (int n = 0; n < 250 && f.rig_.mode() != Mode::tracking; ++n) f.tick();
    ASSERT_EQ(f.rig_.mode(), Mode::tracking);
    f.tick();
    f.armed_commands_ = 0;
    f.stop_after_ = after;
    f.pauses_ = 0;
    ASSERT_EQ(f.give(kTakeoff), kAccepted);
    if (after < 0) {
      EXPECT_EQ(f.give(kStop), kAccepted);
    }
    f.planner_.step();
    if (after >= f.pauses_) {
      EXPECT_EQ(f.give(kStop), kAccepted);
    }
    f.ticks(100);
    EXPECT_EQ(f.armed_commands_, after == 1);
    if (after == 1) {
      // Accepted and armed for already: this autopilot lifts at once. No hold is verified so low: it lands.
      EXPECT_TRUE(f.rig_.mode() == Mode::land || f.rig_.mode() == Mode::passive) << to_string(f.rig_.mode());
      EXPECT_LT(f.rig_.autopilot->truth().p_W.z(), 0.5);
      continue;
    }
    EXPECT_FALSE(f.rig_.autopilot->armed());
    ASSERT_EQ(f.give(kEnable), kAccepted);
    f.ticks(300);
    EXPECT_EQ(f.rig_.mode(), Mode::tracking);
    EXPECT_EQ(f.armed_commands_, 0);
    EXPECT_LT(f.rig_.autopilot->truth().p_W.z(), 0.3);
  }
}

TEST(StopWhilePlanning, AStopWhileEnablingAnArmedVehicleCancelsItEveryTime) {
  for (int after = 0; after < 60; after += 7) {
    SCOPED_TRACE(after);
    Flight f;
    f.ticks(60);
    f.rig_.autopilot->receive(
        mavlink::encode_frame({1, 191, 0}, CommandLong{.param1 = 1, .command = kCommandArm}).view(),
        static_cast<double>(f.rig_.now_ns()) * 1e-9);
    f.ticks(60);
    ASSERT_TRUE(f.rig_.autopilot->armed());
    ASSERT_EQ(f.give(kEnable), kAccepted);
    f.ticks(after);
    if (after > 0 && f.rig_.mode() != Mode::enabling) break;  // it follows by now
    EXPECT_EQ(f.give(kStop), kAccepted);
    f.tick();
    EXPECT_EQ(f.rig_.mode(), Mode::passive);
    f.ticks(300);
    EXPECT_EQ(f.rig_.mode(), Mode::passive);
    EXPECT_STRNE(f.rig_.autopilot->mode(), "offboard");
  }
}

}  // namespace
}  // namespace backwash::daemon::test

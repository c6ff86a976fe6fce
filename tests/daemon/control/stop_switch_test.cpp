// SPDX-License-Identifier: BSD-3-Clause
// docs/faults.md row 37: what the daemon makes of its stop switch, from the reading that the GPIO thread leaves to the
// wire.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>

#include "core/map/octomap/octomap_message.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/out/gpio_worker.hpp"
#include "services/backwashd/plan/mission.hpp"
#include "services/backwashd/plan/planner_worker.hpp"
#include "services/dds/topics.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"
#include "tests/daemon/plan/mission_rig.hpp"

namespace backwash::daemon::test {
namespace {

using firmware_bridge::SwitchState;

constexpr SwitchState kBroken[] = {SwitchState::lost, SwitchState::untested, SwitchState::chattering};

/// A flight whose switch is looked at in each tick.
struct Switched : Lockstep {
  explicit Switched(SwitchState state = SwitchState::released) { set(state); }
  void set(SwitchState state) { channels->stop_switch.state = state; }
  const Wire& look_and_tick() {
    channels->stop_switch.at_ns = now_ns() + 20'000'000;
    return tick();
  }
  /// Half a metre along x from where it stands.
  std::vector<Setpoint> route_from_here() const {
    std::vector<Setpoint> commands;
    for (int k = 0; k <= 100; ++k)
      commands.push_back({view().command.p_W + Vec3(0.005 * k, 0, 0), {0.25, 0, 0}, Vec3::Zero(), view().command.yaw});
    return commands;
  }
  /// Ticks until LAND goes out, or −1 after `most`.
  int ticks_to_land(int most) {
    for (int n = 1; n <= most; ++n)
      if (look_and_tick().commanded(kCommandLand)) return n;
    return -1;
  }
  void fly() {
    // Take-off and route are planned between ticks: the reading must not grow old meanwhile.
    channels->stop_switch.at_ns = INT64_MAX;
    take_off();
    start_route(2);
    ASSERT_EQ(mode(), Mode::tracking);
  }
};

TEST(StopSwitchFault, PressedInFlightItIsAStopInItsTickForAsLongAsItIsPressed) {
  Switched rig;
  rig.fly();
  rig.set(SwitchState::pressed);
  rig.look_and_tick();
  EXPECT_EQ(rig.mode(), Mode::hold);
  EXPECT_EQ(rig.reason(), Reason::stop_requested);
  const auto moving = rig.offer(rig.rise());
  for (int n = 0; n < 500; ++n) {
    EXPECT_FALSE(rig.look_and_tick().commanded(kCommandLand) || rig.wire().commanded(kCommandArm));
    ASSERT_EQ(rig.mode(), Mode::hold) << n;
    ASSERT_EQ(rig.wire().setpoints.size(), 1U);
    ASSERT_NE(rig.view().segment, moving);
  }
  EXPECT_LT(rig.autopilot->truth().v_W.norm(), 0.05) << "it stands";
  rig.set(SwitchState::released);
  for (int n = 0; n < 50; ++n) rig.look_and_tick();
  EXPECT_EQ(rig.mode(), Mode::hold) << "released is no order to go on";
}

TEST(StopSwitchFault, WhatIsOfferedInTheTickOfThePressIsNotFlown) {
  Switched rig;
  rig.channels->stop_switch.at_ns = INT64_MAX;
  rig.take_off();
  rig.set(SwitchState::pressed);
  const auto moving = rig.offer(rig.route_from_here());
  rig.look_and_tick();
  EXPECT_NE(rig.view().segment, moving);
  EXPECT_EQ(rig.reason(), Reason::stop_requested);
  const Vec3 held = rig.view().command.p_W;
  rig.set(SwitchState::released);
  for (int n = 0; n < 100; ++n) rig.look_and_tick();
  EXPECT_EQ(rig.view().command.p_W, held) << "nor after the release";
}

TEST(StopSwitchFault, ABrokenOneStopsTheFlightAndLandsItThreeSecondsLater) {
  for (const SwitchState broken : kBroken) {
    Switched rig;
    rig.fly();
    rig.set(broken);
    rig.look_and_tick();
    EXPECT_EQ(rig.mode(), Mode::hold) << name(broken);
    const int ticks = rig.ticks_to_land(300);
    EXPECT_GE(ticks, 149) << name(broken);
    EXPECT_LE(ticks, 152) << name(broken);
  }
}

TEST(StopSwitchFault, OneThatIsWholeAgainInTimeDoesNotLandTheFlight) {
  Switched rig;
  rig.fly();
  rig.set(SwitchState::chattering);
  for (int n = 0; n < 140; ++n) rig.look_and_tick();
  rig.set(SwitchState::released);
  EXPECT_EQ(rig.ticks_to_land(300), -1);
  EXPECT_EQ(rig.mode(), Mode::hold);
}

TEST(StopSwitchFault, AThreadThatReadsNothingMoreIsALostLine) {
  Switched rig;
  rig.fly();
  rig.look_and_tick();
  int ticks = 0;  // since the last reading
  for (; rig.mode() == Mode::tracking && ticks < 50; ++ticks) rig.tick();
  EXPECT_EQ(rig.mode(), Mode::hold);
  EXPECT_EQ(ticks, 16) << "300 ms";
  EXPECT_EQ(rig.view().stop_switch, SwitchState::lost);
}

TEST(StopSwitchFault, OperatorsMayLandBesideAPressedSwitch) {
  Switched rig;
  rig.fly();
  rig.set(SwitchState::pressed);
  rig.look_and_tick();
  ASSERT_TRUE(rig.channels->orders.push({Request::land, 1}));
  EXPECT_LE(rig.ticks_to_land(5), 5);
  EXPECT_EQ(rig.mode(), Mode::land);
}

TEST(StopSwitchFault, WhileEnablingItEndsThat) {
  for (const SwitchState state : {SwitchState::pressed, SwitchState::lost}) {
    Switched rig;
    for (int n = 0; n < 200; ++n) rig.look_and_tick();
    ASSERT_TRUE(rig.channels->orders.push({Request::enable, 1}));
    rig.look_and_tick();
    ASSERT_EQ(rig.mode(), Mode::enabling);
    rig.set(state);
    rig.look_and_tick();
    EXPECT_EQ(rig.mode(), Mode::passive);
  }
}

TEST(StopSwitchFault, NeitherAPilotNorAnAutopilotThatLandsIsFought) {
  for (const Mode mode : {Mode::passive, Mode::quiet, Mode::land})
    for (const SwitchState state : {SwitchState::pressed, SwitchState::lost, SwitchState::untested}) {
      SwitchReaction reaction;
      for (std::int64_t t = 0; t < 10; ++t) {
        EXPECT_EQ(reaction.request(state, mode, Request::none, t * 1'000'000'000), Request::none);
        EXPECT_EQ(reaction.request(state, mode, Request::enable, t * 1'000'000'000), Request::none);
      }
    }
}

// The control thread ticks before the thread that reads the lines has opened them.
TEST(StopSwitchFault, ANamedSwitchIsLostAndNotAbsentBeforeItIsRead) {
  Channels channels;
  config::Daemon::Gpio names;
  names.chip = "/dev/gpiochip0";
  names.led = "LED";
  const GpioWorker without_switch(channels, names);
  EXPECT_EQ(SwitchReaction::read(channels.stop_switch, 0), SwitchState::absent);
  names.stop_switch = "STOP";
  const GpioWorker with_switch(channels, names);
  EXPECT_EQ(SwitchReaction::read(channels.stop_switch, 0), SwitchState::lost);
}

class StopSwitchMission : public MissionTest {};

TEST_F(StopSwitchMission, NothingThatMovesTheVehicleIsAcceptedAndTheReasonIsTold) {
  const std::pair<SwitchState, const char*> bad[] = {{SwitchState::lost, "cannot be read"},
                                                     {SwitchState::untested, "both positions"},
                                                     {SwitchState::pressed, "pressed"},
                                                     {SwitchState::chattering, "chatters"}};
  for (const auto& [state, why] : bad)
    for (const std::uint8_t verb : {kEnable, kTakeoff, kGoto}) {
      view_.mode = verb == kEnable ? Mode::passive : Mode::tracking;
      view_.landed = verb != kGoto;
      view_.stop_switch = state;
      look();
      const Decision d = give(gcs_.next(verb));
      EXPECT_EQ(d.answer->result, kRefused) << why;
      EXPECT_NE(d.answer->reason.find(std::string("stop switch: ")), std::string::npos) << d.answer->reason;
      EXPECT_NE(d.answer->reason.find(why), std::string::npos) << d.answer->reason;
      EXPECT_FALSE(d.job || d.order);
    }
  for (const SwitchState good : {SwitchState::absent, SwitchState::released}) {
    view_.mode = Mode::tracking;
    view_.landed = false;
    view_.stop_switch = good;
    look();
    EXPECT_EQ(give(gcs_.next(kGoto)).answer->result, kAccepted) << name(good);
    EXPECT_EQ(give(gcs_.next(kStop)).answer->result, kAccepted);
  }
}

// STOP while a plan is under way (docs/faults.md rows 39 and 40): real mission, planner, control loop and emulated
// autopilot in one thread. While the planner waits ticks pass; while it computes, none do.

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

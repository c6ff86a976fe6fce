// SPDX-License-Identifier: BSD-3-Clause
// docs/faults.md row 37: what the daemon makes of its stop switch, from the reading that the GPIO thread leaves to the
// wire.
#include "services/backwashd/channels.hpp"
#include "services/backwashd/out/gpio_worker.hpp"
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

}  // namespace
}  // namespace backwash::daemon::test

// SPDX-License-Identifier: BSD-3-Clause
// The take-off of an autopilot that lifts itself: asked for until it is taken, by the answer to this take-off alone.
#include <gtest/gtest.h>

#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

constexpr std::uint16_t kCommandTakeoff = 22;
constexpr std::uint8_t kCommandAccepted = 0, kCommandFailed = 4;

/// The rig's autopilot under an ArduCopter's heartbeat: in GUIDED, and armed when asked to be. It stays on the ground.
struct LiftsItself : Lockstep {
  LiftsItself() {
    noise = [this](std::vector<std::uint8_t>& bytes) {
      std::vector<std::uint8_t> out;
      mavlink::Parser parser;
      parser.feed(bytes, [&](const mavlink::Frame& f) {
        if (unsupported(f)) return;  // the tests answer to a take-off
        if (f.id != mavlink::Heartbeat::kId) return void(out.insert(out.end(), f.bytes.begin(), f.bytes.end()));
        const mavlink::Heartbeat heartbeat{.custom_mode = 4,
                                           .type = 2,
                                           .autopilot = 3,
                                           .base_mode = static_cast<std::uint8_t>(armed ? 129 : 1),
                                           .system_status = 4,
                                           .mavlink_version = 3};
        const auto frame = mavlink::encode_frame(f.sender, heartbeat);
        out.insert(out.end(), frame.view().begin(), frame.view().end());
      });
      bytes = out;
    };
  }
  /// What an autopilot without a take-off of its own says to one.
  static bool unsupported(const mavlink::Frame& f) {
    return f.id == mavlink::CommandAck::kId && mavlink::decode<mavlink::CommandAck>(f.payload).result == 3;
  }
  /// Ticks, of so many, in which it was asked to take off.
  int asked_within(int count) {
    int asked = 0;
    for (int n = 0; n < count; ++n) {
      asked += tick().commanded(kCommandTakeoff);
      armed = armed || wire().commanded(kCommandArm);
    }
    return asked;
  }
  void answer(std::uint8_t result) {
    say(mavlink::CommandAck{.command = kCommandTakeoff, .result = result, .target_system = 1, .target_component = 191});
  }
  /// Enabled, asked to take off and armed, on the ground.
  void lift() {
    EXPECT_TRUE(channels->orders.push({track::Request::enable}));
    ASSERT_GT(ticks_until(Mode::tracking, 250), 0) << to_string(reason());
    offer(rise(), true, true);
    ASSERT_GT(ticks_until(Mode::lifting, 3), 0) << to_string(reason());
    setpoints_before_lift = view().shown.setpoints_sent;
    armed = true;
    asked_within(60);  // until it says that it is armed
  }
  bool armed = false;
  std::uint64_t setpoints_before_lift = 0;
};

TEST(TakeoffCommand, IsRepeatedUntilTheAutopilotTakesThisOneWhateverItSaidToAnother) {
  LiftsItself rig;
  rig.ticks(60);
  rig.answer(kCommandAccepted);  // to somebody's take-off of before
  rig.ticks(10);
  ASSERT_TRUE(rig.link().telemetry().result_of(kCommandTakeoff)) << "it was heard";
  rig.lift();
  EXPECT_GE(rig.asked_within(100), 3) << "the answer of before says nothing";
  rig.answer(kCommandFailed);
  rig.tick();
  EXPECT_GE(rig.asked_within(100), 3) << "it was refused";
  rig.answer(kCommandAccepted);
  rig.tick();
  EXPECT_EQ(rig.asked_within(100), 0);
  ASSERT_EQ(rig.mode(), Mode::lifting) << to_string(rig.reason());
}

// The order of a STOP reaches the wire: what the tick decides alone stops no motor.
TEST(TakeoffCommand, AStopOnTheGroundAsksToDisarmUnforced) {
  LiftsItself rig;
  rig.ticks(60);
  rig.lift();
  ASSERT_EQ(rig.mode(), Mode::lifting) << to_string(rig.reason());
  ASSERT_TRUE(rig.view().armed);
  EXPECT_TRUE(rig.channels->orders.push({track::Request::stop}));
  int asked = 0;
  for (int n = 0; n < 50; ++n) {
    rig.say(mavlink::ExtendedSysState{.landed_state = 1});
    for (const auto& c : rig.tick().commands)
      if (c.command == kCommandArm) {
        EXPECT_EQ(c.param1, 0) << n;
        EXPECT_EQ(c.param2, 0) << "forced, an autopilot obeys in the air too";
        ++asked;
      }
  }
  EXPECT_GT(asked, 0) << to_string(rig.mode());
}

// A burst of 0.2 s on the line takes both LANDs: the autopilot goes on with its own take-off, and hovers there.
TEST(TakeoffCommand, AStopWhoseLandIsLostOnTheLineCanBeGivenAgain) {
  for (const track::Request again : {track::Request::stop, track::Request::land}) {
    LiftsItself rig;
    rig.ticks(60);
    rig.lift();
    EXPECT_TRUE(rig.channels->orders.push({track::Request::stop}));
    rig.ticks(100);
    ASSERT_EQ(rig.mode(), Mode::land) << to_string(rig.reason());
    ASSERT_TRUE(rig.view().offboard) << "GUIDED as before";
    EXPECT_TRUE(rig.channels->orders.push({again, 2}));
    int asked = 0;
    for (int n = 0; n < 20; ++n) asked += rig.tick().commanded(kCommandLand);
    EXPECT_EQ(asked, 2);
  }
}

// No set-point is sent while it lifts, so none is missed: what waits beside them shows that the line is full.
TEST(TakeoffCommand, ALineThatTakesNothingWhileTheAutopilotLiftsIsQuiet) {
  LiftsItself rig;
  rig.ticks(60);
  rig.lift();
  ASSERT_EQ(rig.mode(), Mode::lifting);
  rig.unread = true;
  int blocked = 0;
  for (int n = 0; n < 500 && rig.mode() == Mode::lifting; ++n) {
    rig.tick();
    blocked += rig.link().transmit().waiting() > 0;
  }
  EXPECT_EQ(rig.mode(), Mode::quiet);
  EXPECT_EQ(rig.reason(), Reason::transmit_full);
  EXPECT_EQ(rig.view().shown.setpoints_sent, rig.setpoints_before_lift) << "there were none";
  EXPECT_LE(blocked, 11) << "200 ms";
}

// A take-off while a live map is as old as its mapper's rate makes it (docs/faults.md row 13).
class LiveTakeOff : public testing::Test {
 protected:
  Lockstep rig_{{0.7, Vec3(5, -3, 0.2)}, Medium::udp};
  std::int64_t age_ns_ = 250'000'000;  // a mapper of 5 Hz, and what its map takes

  void SetUp() override {
    rig_.map_settings.live = true;
    rig_.restart();
    rig_.spoil = [this](OdometrySample&) { rig_.channels->map_ns.store(rig_.now_ns() - age_ns_); };
    rig_.ticks(60);
    EXPECT_TRUE(rig_.channels->orders.push({track::Request::enable}));
    ASSERT_GT(rig_.ticks_until(Mode::tracking, 250), 0) << to_string(rig_.reason());
    rig_.offer(rig_.rise(), true, true);
    ASSERT_GT(rig_.ticks_until(Mode::lifting, 3), 0) << to_string(rig_.reason());
  }
};

// Its clearance is that to the floor, which age times closing_speed passes at once.
TEST_F(LiveTakeOff, IsNotEndedByTheFloorThatItLeaves) {
  EXPECT_GT(rig_.ticks_until(Mode::tracking, 500), 0) << to_string(rig_.reason());
  EXPECT_EQ(rig_.reason(), Reason::lifted_off);
}

TEST_F(LiveTakeOff, LandsWithAMapOlderThanASecond) {
  age_ns_ = 1'100'000'000;
  EXPECT_GT(rig_.ticks_until(Mode::land, 3), 0) << to_string(rig_.mode());
  EXPECT_EQ(rig_.reason(), Reason::map_late);
}

}  // namespace
}  // namespace backwash::daemon::test

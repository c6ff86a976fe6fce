// SPDX-License-Identifier: BSD-3-Clause
// Row 56 of docs/faults.md in lockstep: what the controller said once and does not say any more, or says against what
// its own vehicle does.
#include <gtest/gtest.h>

#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

constexpr std::uint8_t kOnGround = 1, kInAir = 2;

/// The controller's own EXTENDED_SYS_STATE, or another message, does not get through; the test says what it likes.
struct Told : Lockstep {
  explicit Told(std::uint32_t lost = mavlink::ExtendedSysState::kId) : Lockstep({0.7, Vec3(5, -3, 0.2)}, Medium::udp) {
    noise = [this, lost](std::vector<std::uint8_t>& bytes) {
      std::vector<std::uint8_t> out;
      mavlink::Parser parser;
      parser.feed(bytes, [&](const mavlink::Frame& f) {
        if (f.id != lost || !loses) out.insert(out.end(), f.bytes.begin(), f.bytes.end());
      });
      if (const auto said = std::exchange(ground, std::nullopt)) {
        const auto frame = mavlink::encode_frame({1, 1, 0}, mavlink::ExtendedSysState{.landed_state = *said});
        out.insert(out.end(), frame.view().begin(), frame.view().end());
      }
      bytes = out;
    };
  }
  /// Times, in so many ticks, that it was asked to disarm. `lie`: it says that every tick.
  int disarmed(int count, std::optional<std::uint8_t> lie = {}) {
    int asked = 0;
    for (int n = 0; n < count; ++n) {
      if (lie) ground = lie;
      for (const auto& c : tick().commands) asked += c.command == kCommandArm && c.param1 == 0;
    }
    return asked;
  }
  void order(track::Request request) { EXPECT_TRUE(channels->orders.push({request, ++orders_})); }
  bool loses = false;
  std::optional<std::uint8_t> ground;

 private:
  std::uint64_t orders_ = 1;
};

// Once wrong in flight and never said again, or wrong for as long as it is asked: height and flight contradict it.
TEST(OldFacts, AVehicleThatFliesIsNeverAskedToDisarmWhateverItSaidOfTheGround) {
  for (const bool again : {false, true})
    for (const auto request : {track::Request::stop, track::Request::land}) {
      for (const bool on_route : {false, true}) {
        Told rig;
        rig.take_off();
        if (on_route) rig.start_route(1);
        rig.loses = true;
        rig.ground = kOnGround;
        const auto lie = again ? std::optional(kOnGround) : std::nullopt;
        EXPECT_EQ(rig.disarmed(2, lie), 0);
        EXPECT_NE(rig.view().landed, true) << "its height says otherwise";
        rig.order(request);
        EXPECT_EQ(rig.disarmed(1, lie), 0);
        if (request == track::Request::land) rig.order(track::Request::stop);
        EXPECT_EQ(rig.disarmed(200, lie), 0) << again << on_route;
      }
    }
}

TEST(OldFacts, AStopInALiftOffThatLeftTheGroundIsNoWordToDisarm) {
  for (const bool again : {false, true}) {
    Told rig;
    rig.ticks(60);
    rig.order(track::Request::enable);
    ASSERT_GT(rig.ticks_until(Mode::tracking, 250), 0) << to_string(rig.reason());
    rig.loses = true;
    rig.ground = kOnGround;
    rig.offer(rig.rise(), true, true);
    ASSERT_GT(rig.ticks_until(Mode::lifting, 3), 0) << to_string(rig.reason());
    const double stood = rig.autopilot->truth().p_W.z();
    for (int n = 0; n < 200 && rig.autopilot->truth().p_W.z() < stood + 0.3; ++n) {
      if (again) rig.ground = kOnGround;
      rig.tick();
    }
    ASSERT_EQ(rig.mode(), Mode::lifting) << to_string(rig.reason());
    rig.ground = kOnGround;
    rig.order(track::Request::stop);
    const auto lie = again ? std::optional(kOnGround) : std::nullopt;
    EXPECT_EQ(rig.disarmed(1, lie), 0);
    EXPECT_EQ(rig.mode(), Mode::land) << to_string(rig.reason());
    EXPECT_EQ(rig.disarmed(150, lie), 0);
  }
}

TEST(OldFacts, ALiftOffIsNotOverInTheAirThatWasSaidBeforeTheSilence) {
  Told rig;
  rig.ticks(60);
  rig.order(track::Request::enable);
  ASSERT_GT(rig.ticks_until(Mode::tracking, 250), 0) << to_string(rig.reason());
  rig.loses = true;
  rig.ground = kInAir;
  rig.offer(rig.rise(), true, true);
  ASSERT_GT(rig.ticks_until(Mode::lifting, 3), 0) << to_string(rig.reason());
  EXPECT_EQ(rig.ticks_until(Mode::tracking, 590), -1);
  EXPECT_GT(rig.ticks_until(Mode::land, 20), 0);
  EXPECT_EQ(rig.reason(), Reason::lift_timeout);
}

// It may have been armed since: then it is somebody else's, to whom nothing is said.
TEST(OldFacts, AVehicleThatIsSilentIsNotKnownToBeDisarmed) {
  Told rig;
  rig.ticks(120);
  ASSERT_FALSE(rig.view().armed);
  rig.autopilot->mute = true;
  rig.ticks(76 + 50);
  EXPECT_TRUE(rig.view().armed);
  EXPECT_FALSE(rig.view().landed);
  for (int n = 0; n < 100; ++n) EXPECT_TRUE(rig.tick().silent());
  rig.autopilot->mute = false;
  rig.ticks(60);
  EXPECT_FALSE(rig.view().armed);
  EXPECT_EQ(rig.view().landed, true);
}

TEST(OldFacts, ABatteryThatIsNotToldAnyMoreIsToldToBeUnknownAndLandsNobodyTwice) {
  Told rig(mavlink::BatteryStatus::kId);
  rig.take_off();
  rig.autopilot->battery = 0.14;
  ASSERT_GT(rig.ticks_until(Mode::land, 60), 0);
  rig.loses = true;
  rig.ticks(200);
  EXPECT_TRUE(rig.view().battery) << "4 s";
  rig.ticks(60);
  EXPECT_FALSE(rig.view().battery);
  int told = 0;
  while (const auto event = rig.channels->events.pop()) told += event->kind == ControlEvent::Kind::battery_silent;
  EXPECT_EQ(told, 1);
  ASSERT_NE(rig.mode(), Mode::land) << "it has landed";
  rig.order(track::Request::enable);
  ASSERT_GT(rig.ticks_until(Mode::tracking, 250), 0) << to_string(rig.reason());
  rig.loses = false;
  rig.ticks(150);
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
}

}  // namespace
}  // namespace backwash::daemon::test

// SPDX-License-Identifier: BSD-3-Clause
// The take-off of an autopilot that lifts itself: asked for until it is taken, by the answer to this take-off alone.
#include <gtest/gtest.h>

#include "tests/daemon/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

constexpr std::uint16_t kCommandTakeoff = 22;
constexpr std::uint8_t kAccepted = 0, kFailed = 4;

/// The rig's autopilot under an ArduCopter's heartbeat: in GUIDED, and armed when asked to be. It stays on the ground.
struct LiftsItself : Lockstep {
  LiftsItself() {
    noise = [this](std::vector<std::uint8_t>& bytes) {
      std::vector<std::uint8_t> out;
      mavlink::Parser parser;
      parser.feed(bytes, [&](const mavlink::Frame& f) {
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
  bool armed = false;
};

TEST(TakeoffCommand, IsRepeatedUntilTheAutopilotTakesThisOneWhateverItSaidToAnother) {
  LiftsItself rig;
  rig.ticks(60);
  rig.answer(kAccepted);  // to somebody's take-off of before
  rig.ticks(10);
  rig.channels->orders.push({track::Request::enable});
  ASSERT_GT(rig.ticks_until(track::Mode::tracking, 250), 0) << to_string(rig.reason());
  rig.offer(rig.rise(), true, true);
  ASSERT_GT(rig.ticks_until(track::Mode::lifting, 3), 0) << to_string(rig.reason());
  rig.armed = true;
  rig.asked_within(60);  // until it says that it is armed
  EXPECT_GE(rig.asked_within(100), 3) << "the answer of before says nothing";
  rig.answer(kFailed);
  rig.tick();
  EXPECT_GE(rig.asked_within(100), 3) << "it was refused";
  rig.answer(kAccepted);
  rig.tick();
  EXPECT_EQ(rig.asked_within(100), 0);
  ASSERT_EQ(rig.mode(), track::Mode::lifting) << to_string(rig.reason());
}

}  // namespace
}  // namespace backwash::daemon::test

// SPDX-License-Identifier: BSD-3-Clause
// What the bench's profiles of PX4 and ArduCopter send when the daemon asks for it.
#include <gtest/gtest.h>

#include <deque>
#include <map>

#include "firmware_bridge/line_budget.hpp"
#include "services/bench/emulation/firmware.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

using Make = std::unique_ptr<bench::Autopilot> (*)(const bench::Site&);

/// A daemon beside a disarmed autopilot of this profile.
struct Beside : Lockstep {
  explicit Beside(Make make) {
    autopilot = make(bench::Site{.grid = world_->grid, .vehicle = vehicle_5in(), .ground_W = autopilot->truth().p_W});
  }
  /// How often each message was asked for in so many ticks.
  std::map<int, int> asked(int count) {
    std::map<int, int> times;
    for (int n = 0; n < count; ++n)
      for (const auto& c : tick().commands)
        if (c.command == 511) ++times[static_cast<int>(c.param1)];
    return times;
  }
};

TEST(MessageRates, Px4TellsItsModeWithinATenthOfASecond) {
  Beside rig(bench::make_px4);
  rig.ticks(150);
  int longest = 0;
  for (int n = 0; n < 500; ++n) {
    rig.tick();
    const double age = rig.view().heartbeat_age;
    longest = std::max(longest, static_cast<int>(std::lround(age / 0.02)));
  }
  EXPECT_LE(longest, 5) << "ticks since the last HEARTBEAT; 50 at the 1 Hz that it has unasked";
  EXPECT_GE(longest, 3) << "and not at every tick";
}

TEST(MessageRates, ADeniedMessageIsAskedForOnceUntilTheAutopilotWasAway) {
  Beside rig(bench::make_arducopter);
  const int odometry = 331, position = 32;
  auto asked = rig.asked(1000);
  EXPECT_EQ(asked[odometry], 1);
  EXPECT_GE(asked[position], 9);
  rig.autopilot->mute = true;
  rig.ticks(100);
  rig.autopilot->mute = false;
  asked = rig.asked(500);
  EXPECT_EQ(asked[odometry], 1) << "it may be another one now";
}

TEST(MessageRates, AReconnectedLineIsAskedAnew) {
  Beside rig(bench::make_arducopter);
  EXPECT_EQ(rig.asked(500)[331], 1);
  rig.hang_up();
  rig.tick();
  rig.plug_in();
  EXPECT_EQ(rig.asked(500)[331], 1);
}

// As a ground station's REQUEST_DATA_STREAM on the same line does.
TEST(SlowLine, AStreamThatAStationTakesAwayIsBackBeforeItIsMissed) {
  for (const Make make : {&bench::make_px4, &bench::make_arducopter}) {
    Beside rig(make);
    rig.ticks(250);
    ASSERT_LT(rig.view().pose_age, 0.1);
    const mavlink::CommandLong once_a_second{.param1 = 32, .param2 = 1e6, .command = 511, .target_system = 1};
    rig.autopilot->receive(mavlink::encode_frame({255, 190, 0}, once_a_second).view(),
                           static_cast<double>(rig.now_ns()) * 1e-9);
    double oldest = 0;
    for (int n = 0; n < 200; ++n) {
      rig.tick();
      oldest = std::max(oldest, rig.view().pose_age);
    }
    EXPECT_GT(oldest, 0.1) << "it was taken away";
    EXPECT_LT(oldest, 0.2) << "HOLD is at 0.3 s";
  }
}

// What the autopilot says arrives 0.1 s late from some moment on.
TEST(SlowLine, OneThatBecomesSlowIsNamedAndNothingIsEnabledOnIt) {
  for (const Make make : {&bench::make_px4, &bench::make_arducopter}) {
    Beside rig(make);
    rig.ticks(500);
    ASSERT_TRUE(rig.view().round_trip);
    EXPECT_LE(*rig.view().round_trip, firmware_bridge::line_allowed(vehicle_5in(), 0));
    const auto asks_to_enable = [&] {
      EXPECT_TRUE(rig.channels->orders.push({track::Request::enable, rig.view().epoch.order + 1}));
      rig.tick();
      return rig.reason();
    };
    std::deque<std::vector<std::uint8_t>> under_way(5);
    rig.noise = [&](std::vector<std::uint8_t>& said) {
      under_way.push_back(said);
      said = under_way.front();
      under_way.pop_front();
    };
    rig.ticks(150);
    EXPECT_EQ(asks_to_enable(), Reason::line_slow);
    EXPECT_EQ(rig.mode(), Mode::passive);
    EXPECT_GT(*rig.view().round_trip, 0.1);
    EXPECT_EQ(asks_to_enable(), Reason::line_slow);
    rig.noise = {};
    rig.ticks(150);
    EXPECT_NE(asks_to_enable(), Reason::line_slow) << "the line is as fast as before";
  }
}

}  // namespace
}  // namespace backwash::daemon::test

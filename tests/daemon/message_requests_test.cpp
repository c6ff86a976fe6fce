// SPDX-License-Identifier: BSD-3-Clause
// What the bench's profiles of PX4 and ArduCopter send when the daemon asks for it.
#include <gtest/gtest.h>

#include <map>

#include "services/bench/firmware.hpp"
#include "tests/daemon/lockstep.hpp"

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

}  // namespace
}  // namespace backwash::daemon::test

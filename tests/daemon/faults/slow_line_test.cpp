// SPDX-License-Identifier: BSD-3-Clause
// A serial line that does not carry every ODOMETRY (docs/interfaces.md, "MAVLink").
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "services/backwashd/control/link_watch.hpp"
#include "services/backwashd/daemon.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

constexpr double kBaud = 57'600;

/// What arrived in the ticks of a flight.
struct Arrivals {
  std::size_t setpoints = 0, odometry = 0, bytes = 0;
  double oldest_s = 0;       ///< a set-point when it had arrived
  double longest_gap_s = 0;  ///< between two of ODOMETRY
};

Arrivals fly(Lockstep& rig, int ticks) {
  Arrivals a;
  std::uint64_t last_us = 0;
  for (int n = 0; n < ticks; ++n) {
    const Wire& wire = rig.tick();
    for (const auto& s : wire.setpoints) {
      const auto age_ms = static_cast<std::uint32_t>(rig.now_ns() / 1'000'000) - s.time_boot_ms;
      a.oldest_s = std::max(a.oldest_s, age_ms * 1e-3);
    }
    if (wire.odometry > 0) {
      if (last_us > 0)
        a.longest_gap_s = std::max(a.longest_gap_s, 1e-6 * static_cast<double>(wire.odometry_us - last_us));
      last_us = wire.odometry_us;
    }
    a.setpoints += wire.setpoints.size();
    a.odometry += static_cast<std::size_t>(wire.odometry);
    a.bytes += wire.bytes;
  }
  return a;
}

constexpr int kTicks = 200;
// An ODOMETRY, the set-point and a TIMESYNC of its tick, and that the rig hands over whole ticks.
constexpr double kLatest = (245 + 65 + 30) * 10 / kBaud + 0.04;

TEST(SlowLine, AFlightAt57600BaudGetsEverySetpointInTimeAndOdometryAsOftenAsEstimatorsNeed) {
  InFlight rig;
  rig.slow_line(kBaud, true);
  rig.ticks(25);
  const Arrivals a = fly(rig, kTicks);
  std::printf("%zu set-points, oldest %.0f ms; ODOMETRY %zu, longest gap %.0f ms; %.0f %% of the line\n", a.setpoints,
              1e3 * a.oldest_s, a.odometry, 1e3 * a.longest_gap_s, 100.0 * a.bytes * 10 / (kBaud * kTicks * 0.02));
  EXPECT_NEAR(static_cast<double>(a.setpoints), kTicks, 3);
  EXPECT_LE(a.oldest_s, kLatest);
  EXPECT_LE(a.longest_gap_s, firmware_bridge::kLongestOdometryTicks * kControlPeriod + 1e-9);
  EXPECT_GE(a.odometry, kTicks / firmware_bridge::kLongestOdometryTicks);
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
  EXPECT_EQ(rig.view().shown.samples_outside, 0U);
}

// Else the test above could not fail.
TEST(SlowLine, WithoutThinningSetpointsComeSecondsLate) {
  InFlight rig;
  rig.slow_line(kBaud, false);
  const Arrivals a = fly(rig, kTicks);
  EXPECT_LT(a.setpoints, std::size_t{kTicks} / 2);
  EXPECT_GT(a.oldest_s, 1.0);
}

struct ConfiguredLine : testing::Test {
  decltype(config::Daemon::link) link;
  ConfiguredLine() {
    link.baud = 57'600;
    link.endpoint.kind = config::LinkDevice::Kind::serial;
  }
  void expect_refused(const std::string& part) {
    const auto line = configured_line(link);
    ASSERT_FALSE(line);
    EXPECT_NE(line.error().find(part), std::string::npos) << line.error();
  }
};

TEST_F(ConfiguredLine, ASerialPortHasItsRateAndASocketNone) {
  EXPECT_NEAR(configured_line(link)->bytes_per_second, 0.95 * 5760, 1e-9);
  link.endpoint.kind = config::LinkDevice::Kind::udp;
  EXPECT_TRUE(std::isinf(configured_line(link)->bytes_per_second));
  link.share = 1;
  EXPECT_NEAR(configured_line(link)->bytes_per_second, 5760, 1e-9);
}

TEST_F(ConfiguredLine, OneThatCannotCarryAFlightIsRefusedWithTheBaudThatIsNeeded) {
  link.baud = 38'400;
  expect_refused("'link.baud' = 38400");
  const auto refusal = configured_line(link).error();
  link.baud = std::stoi(refusal.substr(refusal.find("a baud of ") + 10));
  EXPECT_TRUE(configured_line(link)) << "what is asked for is enough";
  link.baud -= 200;
  EXPECT_FALSE(configured_line(link)) << "and hardly more than that";
}

TEST_F(ConfiguredLine, ASharedRadioAndSignaturesNeedMore) {
  link.share = 0.5;
  expect_refused("at a share of 0.5");
  link.share.reset();
  link.signing_key.emplace();
  expect_refused("a baud of");
  link.baud = 115'200;
  EXPECT_TRUE(configured_line(link));
  link.signing_key.reset();
  link.baud = 48'000;
  expect_refused("'link.baud' = 48000");
  link.protocol = config::LinkProtocol::plain;
  EXPECT_TRUE(configured_line(link)) << "its frames are shorter";
}

// PX4 begins with external vision only while samples are less than 200 ms apart.
TEST_F(ConfiguredLine, SlowOdometryLeavesTheLineTheRestOfTwoHundredMilliseconds) {
  EXPECT_TRUE(configured_line(link, {20, 0}));
  const auto refused = configured_line(link, {10, 0});
  ASSERT_FALSE(refused) << "100 ms between samples and 160 ms on this line";
  EXPECT_NE(refused.error().find("every 100 ms"), std::string::npos) << refused.error();
  link.baud = 115'200;
  EXPECT_TRUE(configured_line(link, {9, 0}));
}

TEST(Start, ALineThatCannotCarryAFlightIsRefusedBeforeAnyPortOpens) {
  const std::string path = testing::TempDir() + "slow.daemon.toml";
  std::ifstream shipped(std::string(BACKWASH_SOURCE_DIR) + "/core/config/files/backwashd.daemon.toml");
  std::string text((std::istreambuf_iterator<char>(shipped)), {});
  text.replace(text.find("baud = 921600"), 13, "baud = 19200 ");
  std::ofstream(path) << text;
  const auto settings = load_settings(path);
  std::filesystem::remove(path);
  ASSERT_FALSE(settings);
  const std::string said = settings.error().what();
  EXPECT_NE(said.find("slow.daemon.toml: key 'link.baud' = 19200"), std::string::npos) << said;
}

}  // namespace
}  // namespace backwash::daemon::test

// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/autopilot/autopilot_flight.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/log/raw/tick_log.hpp"

namespace backwash::log {
namespace {

constexpr std::int64_t kTick_ns = 20'000'000;

/// Ticks from `first_ns` on, in each of which the autopilot says where it is at 2 m/s along x.
RawLog told(std::int64_t first_ns, int ticks) {
  RawLog log;
  for (int n = 0; n < ticks; ++n) {
    track::TickInput in;
    in.now_ns = first_ns + n * kTick_ns;
    track::AutopilotFacts::Pose pose;
    pose.at_ns = in.now_ns;
    pose.state.p_W = {2e-9 * static_cast<double>(in.now_ns), 1, 2};
    if (n % 2 == 0) in.autopilot.pose = pose;
    const TickInputRecord row = encode(in).input;
    RawRecord record{{in.now_ns, RecordKind::tick_input, sizeof row}, std::vector<std::uint8_t>(sizeof row)};
    std::memcpy(record.bytes.data(), &row, sizeof row);
    log.records.push_back(std::move(record));
  }
  return log;
}

/// The same way as its own log has it, `off` beside it.
std::vector<AutopilotPose> logged(std::int64_t first_ns, int rows, const Vec3& off) {
  std::vector<AutopilotPose> poses;
  for (std::int64_t t = first_ns; t < first_ns + rows * kTick_ns; t += kTick_ns)
    poses.push_back({t, {{Vec3(2e-9 * static_cast<double>(t), 1, 2) + off, Vec3::Zero()}, {}}});
  return poses;
}

TEST(AutopilotFlight, IsAsFarFromTheLinkAsItIsBesideIt) {
  const RawLog log = told(1'000'000'000, 200);
  EXPECT_NEAR(distance_from_link(log, logged(1'000'000'000, 200, Vec3::Zero())).value(), 0, 1e-9);
  EXPECT_NEAR(distance_from_link(log, logged(2'000'000'000, 50, {0, 3, 4})).value(), 5, 1e-9) << "a part of the time";
  EXPECT_NEAR(distance_from_link(log, logged(1'005'000'000, 200, Vec3::Zero())).value(), 0.01, 1e-9) << "5 ms at 2 m/s";
}

TEST(AutopilotFlight, OfAnotherTimeHasNoDistance) {
  const RawLog log = told(1'000'000'000, 200);
  EXPECT_FALSE(distance_from_link(log, logged(6'000'000'000, 200, Vec3::Zero())));
  EXPECT_FALSE(distance_from_link(log, logged(0, 40, Vec3::Zero())));
  EXPECT_FALSE(distance_from_link(log, {}));
}

// Both logs hold a minute on the pad; in the air they have nothing in common.
TEST(AutopilotFlight, OfAnotherFlightFromTheSamePadIsFarInTheAir) {
  RawLog log = told(0, 3000);
  for (RawRecord& record : log.records) {
    TickInputRecord row;
    std::memcpy(&row, record.bytes.data(), sizeof row);
    auto in = decode(row, nullptr);
    if (in.autopilot.pose) in.autopilot.pose->state.p_W.x() = std::max(0.0, 1e-9 * static_cast<double>(in.now_ns) - 50);
    row = encode(in).input;
    std::memcpy(record.bytes.data(), &row, sizeof row);
  }
  auto still = logged(0, 3000, Vec3::Zero());
  for (auto& pose : still) pose.moving.state.p_W = {0, 1, 2};
  EXPECT_GT(distance_from_link(log, still).value(), 3);
}

TEST(AutopilotFlight, APoseThatIsNoNumberIsNoDistance) {
  auto poses = logged(1'000'000'000, 200, Vec3::Zero());
  for (std::size_t n = 0; n < 150; ++n) poses[n].moving.state.p_W.x() = std::nan("");
  EXPECT_NEAR(distance_from_link(told(1'000'000'000, 200), poses).value(), 0, 1e-9);
  for (auto& pose : poses) pose.moving.state.p_W.x() = std::nan("");
  EXPECT_FALSE(distance_from_link(told(1'000'000'000, 200), poses));
}

}  // namespace
}  // namespace backwash::log

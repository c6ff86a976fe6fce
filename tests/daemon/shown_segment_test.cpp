// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/shown_segment.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string_view>

namespace backwash::daemon {
namespace {

TEST(ShownSegment, IsInTheFrameThatTheConfigurationCallsTheMaps) {
  track::AcceptedSegment segment{};
  const Vec3 still = Vec3::Zero();
  segment.commands = {{{1, 2, 3}, still, still, 0.4}, {{4, 5, 6}, still, still, -0.4}};
  segment.tube.resize(1);
  segment.tube[0].center.p_W = {7, 8, 9};
  segment.tube[0].half_widths_interval.fill(0.25);
  const ShownSegment shown(segment, "site");
  EXPECT_EQ(shown.tube().header.frame_id, std::string_view("site"));
  EXPECT_EQ(shown.trajectory().header.frame_id, std::string_view("site"));
  ASSERT_EQ(shown.trajectory().poses._length, 2u);
  const dds::PoseStamped& second = shown.trajectory().poses._buffer[1];
  EXPECT_EQ(second.header.frame_id, std::string_view("site"));
  EXPECT_EQ(second.pose.position.y, 5);
  EXPECT_DOUBLE_EQ(2 * std::atan2(second.pose.orientation.z, second.pose.orientation.w), -0.4);
  ASSERT_EQ(shown.tube().steps._length, 1u);
  EXPECT_EQ(shown.tube().steps._buffer[0].center.z, 9);
  EXPECT_EQ(shown.tube().steps._buffer[0].half_widths[4], 0.25);
}

}  // namespace
}  // namespace backwash::daemon

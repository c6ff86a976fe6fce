// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/out/shown_segment.hpp"

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

// 250 steps of one set each along x: every set lies in one of the boxes, and none of them is a box of all.
TEST(ShownSegment, EverySetLiesInOneOfAHundredBoxes) {
  track::AcceptedSegment segment{};
  segment.commands = {{{0, 0, 1}, Vec3::Zero(), Vec3::Zero(), 0}, {{2.5, 0, 1}, Vec3::Zero(), Vec3::Zero(), 0}};
  segment.tube.resize(250);
  for (std::size_t n = 0; n < segment.tube.size(); ++n) {
    segment.tube[n].center.p_W = {0.01 * static_cast<double>(n), 0, 1};
    segment.tube[n].half_widths_interval = {0.1, 0.05 + 0.001 * static_cast<double>(n % 7), 0.2, 0.1, 0.1};
  }
  const ShownSegment shown(segment, "map");
  const auto& markers = shown.markers().markers;
  ASSERT_EQ(markers._length, 2u + 84u) << "what was there is deleted; a line; three steps a box";
  EXPECT_EQ(markers._buffer[0].action, 3);
  EXPECT_EQ(markers._buffer[1].type, 4);
  EXPECT_EQ(markers._buffer[1].points._length, 2u);
  for (const auto& step : segment.tube) {
    bool inside = false;
    for (std::uint32_t n = 2; n < markers._length; ++n) {
      const auto& m = markers._buffer[n];
      EXPECT_LT(m.scale.x, 0.3);
      const Vec3 off(step.center.p_W.x() - m.pose.position.x, step.center.p_W.y() - m.pose.position.y,
                     step.center.p_W.z() - m.pose.position.z);
      const Vec3 room = Vec3(m.scale.x, m.scale.y, m.scale.z) / 2 - off.cwiseAbs();
      inside =
          inside || (room.x() > 0.1 - 1e-9 && room.y() > step.half_widths_interval[1] - 1e-9 && room.z() > 0.2 - 1e-9);
    }
    EXPECT_TRUE(inside) << step.center.p_W.x();
  }
}

TEST(ShownSegment, MarkersOfNothingDeleteWhatWasThere) {
  const ShownSegment shown(track::AcceptedSegment{}, "map");
  ASSERT_EQ(shown.markers().markers._length, 2u);
  EXPECT_EQ(shown.markers().markers._buffer[0].action, 3);
}

}  // namespace
}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/in/pose_source.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace backwash::daemon {
namespace {

/// What became of transforms, each given as its frame and its child; none: no string at all.
struct Heard {
  std::vector<std::string> said;
  OurTransforms ours{config::Daemon{}};

  void hear(const char* frame, const char* child) {
    dds::TransformStamped m{};
    m.header.frame_id = const_cast<char*>(frame);
    m.child_frame_id = const_cast<char*>(child);
    m.transform.translation.x = 3;
    ours.take(m, {},
              {[&](const dds::Odometry& o, const dds::Guid&) {
                 EXPECT_EQ(o.pose.pose.position.x, 3);
                 said.push_back("pose in " + std::string(o.header.frame_id));
               },
               [&](const dds::TransformStamped&, const dds::Guid&) { said.emplace_back("closure"); },
               [&](const PoseTakers::Why& why) { said.push_back(why()); }});
  }
};

TEST(OurTransforms, AreTheVehiclesInTheMapOrTheOdometryAndTheClosureBetweenThem) {
  Heard h;
  h.hear("map", "base_link");
  h.hear("odom", "base_link");
  h.hear("map", "odom");
  EXPECT_EQ(h.said, (std::vector<std::string>{"pose in map", "pose in odom", "closure"}));
}

// The vehicle in a third frame, by whatever writer, reaches neither the odometry's checks nor its counts.
TEST(OurTransforms, AVehicleWithASecondParentIsHeardInOurFramesAlone) {
  Heard h;
  h.hear("map", "base_link");
  h.hear("earth", "base_link");
  h.hear("odom", "map");
  h.hear("base_link", "base_link");
  h.hear(nullptr, nullptr);
  EXPECT_EQ(h.said.size(), 1u);
}

TEST(OurTransforms, UntilTheVehicleIsHeardOthersAreNamedWithWhatWouldBeRight) {
  Heard h;
  for (const char* frame : {"earth", "/map"}) {
    h.hear(frame, "base_link");
    EXPECT_NE(h.said.back().find("'base_link' in '" + std::string(frame) + "'"), std::string::npos) << h.said.back();
    EXPECT_NE(h.said.back().find("expected 'base_link' in 'map' or 'odom'"), std::string::npos) << h.said.back();
  }
  h.hear(nullptr, nullptr);
  EXPECT_EQ(h.said.size(), 3u);
}

}  // namespace
}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
// Row 7: what carrying the vehicle about before it is enabled shows of frames that do not match.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>

#include "core/track/frame_alignment.hpp"

namespace backwash::track {
namespace {

/// Six seconds of motion along all axes; `wrong` changes what the controller says of it.
Mismatch after(const std::function<void(FramePose&)>& wrong) {
  FrameAlignment alignment;
  for (int n = 0; n < 300; ++n) {
    const double t = 0.02 * n;
    // Circles: no two axes move alike, which a turn could explain.
    const FramePose map{{std::sin(2 * t) / 2, -std::cos(2 * t) / 2, 0.5 * std::sin(0.9 * t)},
                        0.3,
                        {std::cos(2 * t), std::sin(2 * t), 0.45 * std::cos(0.9 * t)}};
    FramePose local = map;
    wrong(local);
    alignment.update(map, local, 0.02, true);
  }
  return alignment.mismatch();
}

Vec3 up_tilted(const Vec3& axis, double angle) { return Eigen::AngleAxisd(angle, axis) * Vec3::UnitZ(); }

TEST(FrameMismatch, FramesThatMatchShowNone) {
  EXPECT_EQ(after([](auto&) {}), Mismatch::none);
}

TEST(FrameMismatch, NamesTheAxisThatIsMirroredOrDead) {
  const Mismatch names[] = {Mismatch::x, Mismatch::y, Mismatch::z};
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(after([=](auto& l) {
                l.p[axis] *= -1;
                l.v[axis] *= -1;
              }),
              names[axis]);
    EXPECT_EQ(after([=](auto& l) { l.v[axis] = 0; }), names[axis]);
  }
}

TEST(FrameMismatch, NamesAYawOfMoreThanTenDegrees) {
  const auto turned = [](double degrees) {
    return after([=](auto& l) {
      const Eigen::AngleAxisd R(degrees * std::numbers::pi / 180, Vec3::UnitZ());
      l.p = R * l.p;
      l.v = R * l.v;  // the heading is right, the motion is in another frame
    });
  };
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_EQ(turned(sign * 9), Mismatch::none);
    EXPECT_EQ(turned(sign * 11), Mismatch::yaw);
    EXPECT_EQ(turned(sign * 90), Mismatch::yaw);
  }
}

TEST(FrameMismatch, NamesATiltOfMoreThanFiveDegrees) {
  const auto tilted = [](const Vec3& axis, double degrees) {
    return after([=](auto& l) { l.up_B = up_tilted(axis, degrees * std::numbers::pi / 180); });
  };
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_EQ(tilted(Vec3::UnitX(), sign * 4.8), Mismatch::none);
    EXPECT_EQ(tilted(Vec3::UnitX(), sign * 5.2), Mismatch::roll);
    EXPECT_EQ(tilted(Vec3::UnitY(), sign * 4.8), Mismatch::none);
    EXPECT_EQ(tilted(Vec3::UnitY(), sign * 5.2), Mismatch::pitch);
  }
  EXPECT_EQ(tilted(Vec3::UnitX(), 180), Mismatch::roll) << "upside down";
}

}  // namespace
}  // namespace backwash::track

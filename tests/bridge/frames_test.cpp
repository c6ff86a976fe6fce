// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/mavlink/frames.hpp"

#include <gtest/gtest.h>

#include <random>

namespace backwash::mavlink::test {
namespace {

/// Columns of R_NW: east, north and up in NED; of R_BF: forward, right and down in FLU.
Mat3 ned_from_world() {
  Mat3 r;
  r.col(0) = Vec3(0, 1, 0);
  r.col(1) = Vec3(1, 0, 0);
  r.col(2) = Vec3(0, 0, -1);
  return r;
}
Mat3 flu_from_frd() { return Vec3(1, -1, -1).asDiagonal(); }

class RandomMotion : public testing::Test {
 protected:
  double draw() { return std::normal_distribution<double>()(random_); }
  Vec3 vector() { return {draw(), draw(), draw()}; }
  Eigen::Quaterniond attitude() { return Eigen::Quaterniond(draw(), draw(), draw(), draw()).normalized(); }
  std::mt19937 random_{11};
};
using FrameConversion = RandomMotion;

TEST_F(FrameConversion, MapsVectorsAsTheRotationMatricesDo) {
  for (int i = 0; i < 1000; ++i) {
    const Vec3 v = vector();
    EXPECT_LT((swap_ned(v) - ned_from_world() * v).norm(), 1e-15);
    EXPECT_LT((swap_frd(v) - flu_from_frd().transpose() * v).norm(), 1e-15);
  }
}

TEST_F(FrameConversion, MapsAttitudesAsTheRotationMatricesDo) {
  for (int i = 0; i < 1000; ++i) {
    const auto q = attitude();
    const Mat3 expected = ned_from_world() * q.toRotationMatrix() * flu_from_frd();
    EXPECT_LT((swap_ned_frd(q).toRotationMatrix() - expected).norm(), 1e-14);
    EXPECT_GE(swap_ned_frd(q).w(), 0);
  }
}

TEST_F(FrameConversion, IsItsOwnInverse) {
  for (int i = 0; i < 1000; ++i) {
    const auto q = attitude();
    EXPECT_LT(swap_ned_frd(swap_ned_frd(q)).angularDistance(q), 1e-7);
    const double yaw = std::remainder(10 * draw(), 2 * std::numbers::pi);
    EXPECT_NEAR(std::remainder(swap_yaw(swap_yaw(yaw)) - yaw, 2 * std::numbers::pi), 0, 1e-14);
  }
}

TEST_F(FrameConversion, YawIsTheHeadingOfTheForwardAxisInBothFrames) {
  for (int i = 0; i < 1000; ++i) {
    const double yaw = 4 * draw();
    const Vec3 forward_N = ned_from_world() * Vec3(std::cos(yaw), std::sin(yaw), 0);
    const double expected = std::atan2(forward_N.y(), forward_N.x());  // clockwise from north
    EXPECT_NEAR(std::remainder(swap_yaw(yaw) - expected, 2 * std::numbers::pi), 0, 1e-12);
    EXPECT_LE(std::abs(swap_yaw(yaw)), std::numbers::pi + 1e-12);
  }
}

TEST(FrameConversions, LevelAndFacingNorthIsTheIdentityInNed) {
  const Eigen::Quaterniond facing_north(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ()));
  EXPECT_LT(swap_ned_frd(facing_north).angularDistance(Eigen::Quaterniond::Identity()), 1e-7);
}

}  // namespace
}  // namespace backwash::mavlink::test

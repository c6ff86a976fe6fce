// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/scan_placement.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "tests/daemon/lockstep/frames.hpp"
#include "tests/daemon/map/map_worker_rig.hpp"

namespace backwash::daemon {
namespace {

OdometrySample pose(const Vec3& p, double yaw, double t) {
  OdometrySample s;
  s.stamp_ns = std::lround(t * 1e9);
  s.state.p_W = p;
  s.q = {std::cos(yaw / 2), 0, 0, std::sin(yaw / 2)};
  return s;
}

/// Cloud of single points in `frame`, stamped t.
struct PointMessage {
  std::array<std::string, 3> names{"x", "y", "z"};
  std::array<dds::PointField, 3> fields{};
  std::array<float, 3> data{};
  dds::PointCloud m{};
  PointMessage(const std::string& frame, const Vec3& p, double t) {
    for (std::uint32_t n = 0; n < 3; ++n) {
      fields[n] = {dds::c_string(names[n]), 4 * n, 7, 1};
      data[n] = static_cast<float>(p[n]);
    }
    m.header.stamp = {static_cast<std::int32_t>(t), static_cast<std::uint32_t>(std::lround((t - std::floor(t)) * 1e9))};
    m.header.frame_id = dds::c_string(frame);
    m.height = m.width = 1;
    m.point_step = m.row_step = 12;
    m.fields = {3, 3, fields.data(), false};
    m.data = {12, 12, reinterpret_cast<std::uint8_t*>(data.data()), false};
  }
};

TEST(ScanPlacement, PlacesAScanOfTheBodyByThePoseAtItsStamp) {
  ScanPlacement l(config::Daemon{});
  EXPECT_FALSE(l.scan(PointMessage(kBody, {1, 0, 0}, 1).m, 0)) << "without odometry it has no place";
  l.add(pose({0, 0, 1}, 0, 1.0));
  l.add(pose({2, 0, 1}, 0.4, 1.1));
  const auto scan = l.scan(PointMessage(kBody, {1, 0, 0}, 1.05).m, 3);
  ASSERT_TRUE(scan) << scan.error();
  EXPECT_LT((scan->sensor_W - Vec3(1, 0, 1)).norm(), 1e-6);
  EXPECT_LT((scan->points_W[0] - Vec3(1 + std::cos(0.2), std::sin(0.2), 1)).norm(), 1e-6);
  EXPECT_EQ(scan->received_ns, 3);
  EXPECT_FALSE(l.scan(PointMessage(kBody, {1, 0, 0}, 1.3).m, 0)) << "too far from the newest odometry";
  EXPECT_FALSE(l.scan(PointMessage(kUnknownFrame, {1, 0, 0}, 1.05).m, 0));
  EXPECT_EQ(l.scan(PointMessage(kMap, {1, 0, 0}, 1.05).m, 0)->points_W[0], Vec3(1, 0, 0));
}

TEST(ScanPlacement, BetweenPosesFartherApartThanTwoOfTheSlowestOdometryAScanHasNoPlace) {
  ScanPlacement l(config::Daemon{});
  l.add(pose({0, 0, 1}, 0, 1.0));
  l.add(pose({2, 0, 1}, 0, 1.11));
  EXPECT_FALSE(l.scan(PointMessage(kBody, {1, 0, 0}, 1.05).m, 0));
}

TEST(ScanPlacement, ALoopClosureMovesThePosesBeforeItAndScansOfTheVio) {
  ScanPlacement l(config::Daemon{});
  EXPECT_FALSE(l.scan(PointMessage(kOdom, {1, 0, 0}, 1).m, 0));
  OdometrySample before = pose({1, 0, 1}, 0, 1.0), after = pose({1, 3, 1}, 0, 1.1);
  before.closures = 1;
  after.closures = 2;
  after.map_from_odom.t = {0, 2, 0};
  l.add(before);
  EXPECT_FALSE(l.scan(PointMessage(kOdom, {1, 0, 0}, 1).m, 0)) << "before it was told of the closure";
  l.close(after.map_from_odom);
  l.add(after);
  EXPECT_EQ(l.scan(PointMessage(kOdom, {1, 0, 0}, 1.1).m, 0)->points_W[0], Vec3(1, 2, 0));
  EXPECT_LT((l.scan(PointMessage(kBody, {1, 0, 0}, 1.0).m, 0)->points_W[0] - Vec3(2, 2, 1)).norm(), 1e-9);
}

TEST(ScanPlacement, AStampThatStandsStillOrFloodsKeepsABoundedHistory) {
  ScanPlacement l(config::Daemon{});
  for (int n = 0; n < 100'000; ++n) l.add(pose({1.0 * n, 0, 1}, 0, 1.0));
  for (int n = 0; n < 100'000; ++n) l.add(pose({7, 0, 1}, 0, 1.0 + 1e-6 * n));
  EXPECT_LE(l.poses(), 2048u);
  EXPECT_EQ(l.scan(PointMessage(kBody, {1, 0, 0}, 1.1).m, 0)->points_W[0], Vec3(8, 0, 1));
}

TEST(NewVoxels, CoverEveryNewPointAndNoKnownOneInAtMost256Boxes) {
  std::mt19937_64 random(1);
  for (const int points : {3, 200, 5000}) {
    map::OccupancyGrid grid({-1, -2, 0}, 0.1, {60, 50, 30}, map::Cell::free);
    for (int n = 0; n < 2000; ++n) grid.set(grid.voxel(random() % grid.cell_count()), map::Cell::occupied);
    std::uniform_real_distribution<double> x(-1.2, 5.2), y(-2.2, 3.2), z(-0.2, 3.2);
    Scan scan;
    scan.sensor_W = {2, 0, 1};
    for (int n = 0; n < points; ++n) scan.points_W.emplace_back(x(random), y(random), z(random));
    const NewVoxels found = new_voxels(grid, scan, 2.5);
    EXPECT_LE(found.count, NewVoxels::kMost);
    EXPECT_GT(found.count, 0u);
    if (points == 3) {
      EXPECT_DOUBLE_EQ(found.edge, 0.1);
    }
    for (const Vec3& p : scan.points_W) {
      if ((p - scan.sensor_W).norm() > 2.5 || !grid.free(grid.index(p))) continue;
      ASSERT_TRUE(holds(found, p)) << p.transpose();
    }
  }
  const map::OccupancyGrid empty({0, 0, 0}, 0.1, {40, 10, 10}, map::Cell::free);
  const Scan far_and_near{{{2.75, 0.5, 0.5}, {2.45, 0.5, 0.5}}, {0.1, 0.5, 0.5}, 0};
  EXPECT_EQ(new_voxels(empty, far_and_near, 2.5).count, 1u) << "what lies beyond the range is no obstacle";
  map::OccupancyGrid full({0, 0, 0}, 0.1, {10, 10, 10}, map::Cell::occupied);
  EXPECT_EQ(new_voxels(full, Scan{{{0.5, 0.5, 0.5}}, {0.1, 0.1, 0.1}, 0}, 5).count, 0u);
}

}  // namespace
}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "services/backwashd/map/cloud.hpp"
#include "services/backwashd/map/scan_placement.hpp"
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

TEST(ScanPlacement, LeavesOutTheVehicleItselfAndNoReturnsAndNothingElse) {
  ScanPlacement l(config::Daemon{}, 0.16);
  l.add(pose({2, 0, 1}, 0.4, 1.0));
  for (const Vec3& own : {Vec3(0.1, -0.1, 0.02), Vec3(0, 0, 0), Vec3(-0.15, 0, 0)}) {  // arms, and no return
    const auto scan = l.scan(PointMessage(kBody, own, 1.0).m, 3);
    ASSERT_TRUE(scan) << scan.error();
    EXPECT_TRUE(scan->points_W.empty()) << own.transpose();
    EXPECT_EQ(scan->own, 1u);
  }
  for (const auto& [frame, other] :
       {std::pair{kBody, Vec3(0.17, 0, 0)}, {kBody, Vec3(0, 0, -0.17)}, {kMap, Vec3(0, 0, 0)}}) {
    const auto scan = l.scan(PointMessage(frame, other, 1.0).m, 3);
    EXPECT_EQ(scan->points_W.size(), 1u) << frame << " " << other.transpose();
    EXPECT_EQ(scan->own, 0u);
  }
  EXPECT_TRUE(l.scan(PointMessage(kMap, {2.1, 0, 1.1}, 1.0).m, 3)->points_W.empty()) << "placed by somebody else";
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

/// A PointCloud2 that owns its memory.
struct Message {
  std::vector<std::string> names;
  std::vector<dds::PointField> fields;
  std::vector<std::uint8_t> data;
  dds::PointCloud m{};

  template <typename Number>
  Message(std::vector<std::string> columns, std::uint8_t type, const std::vector<Number>& values,
          std::uint32_t height = 1)
      : names(std::move(columns)), data(values.size() * sizeof(Number)) {
    std::memcpy(data.data(), values.data(), data.size());
    for (std::size_t n = 0; n < names.size(); ++n)
      fields.push_back({dds::c_string(names[n]), static_cast<std::uint32_t>(n * sizeof(Number)), type, 1});
    m.height = height;
    m.width = static_cast<std::uint32_t>(values.size() / names.size()) / height;
    m.point_step = static_cast<std::uint32_t>(names.size() * sizeof(Number));
    m.row_step = m.width * m.point_step;
    m.fields = {static_cast<std::uint32_t>(fields.size()), static_cast<std::uint32_t>(fields.size()), fields.data(),
                false};
    m.data = {static_cast<std::uint32_t>(data.size()), static_cast<std::uint32_t>(data.size()), data.data(), false};
  }
};

constexpr std::uint8_t kInt32 = 5, kFloat32 = 7, kFloat64 = 8;

TEST(Cloud, HoldsEveryFinitePointWhateverTheFieldsOrderAndType) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Message singles({"intensity", "z", "x", "y"}, kFloat32,
                        std::vector<float>{9, 3, 1, 2, 9, nan, 4, 5, 9, 6, 4, 5});
  const auto a = decode_cloud(singles.m);
  ASSERT_TRUE(a) << a.error();
  EXPECT_EQ(a->points, (std::vector<Vec3>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_FALSE(a->viewpoint);
  const Message doubles({"x", "y", "z"}, kFloat64, std::vector<double>{1, 2, 3, 4, 5, 6}, 2);
  const auto b = decode_cloud(doubles.m);
  ASSERT_TRUE(b) << b.error();
  EXPECT_EQ(b->points, a->points);
}

TEST(Cloud, ReadsTheViewpointFromTheFirstPoint) {
  const Message message({"x", "y", "z", "vp_x", "vp_y", "vp_z"}, kFloat32,
                        std::vector<float>{1, 2, 3, 7, 8, 9, 4, 5, 6, 0, 0, 0});
  const auto cloud = decode_cloud(message.m);
  ASSERT_TRUE(cloud) << cloud.error();
  EXPECT_EQ(*cloud->viewpoint, Vec3(7, 8, 9));
}

TEST(Cloud, RefusesWhatItCannotRead) {
  const std::vector<float> six{1, 2, 3, 4, 5, 6};
  EXPECT_FALSE(decode_cloud(Message({"x", "y", "t"}, kFloat32, six).m));
  EXPECT_FALSE(decode_cloud(Message({"x", "y", "z"}, kInt32, six).m));
  Message big_endian({"x", "y", "z"}, kFloat32, six);
  big_endian.m.is_bigendian = true;
  EXPECT_FALSE(decode_cloud(big_endian.m));
  Message beyond({"x", "y", "z"}, kFloat32, six);
  beyond.fields[2].offset = 9;
  EXPECT_FALSE(decode_cloud(beyond.m));
  Message none({"x", "y", "z"}, kFloat32, six);
  none.m.width = 0;
  ASSERT_TRUE(decode_cloud(none.m));
  EXPECT_TRUE(decode_cloud(none.m)->points.empty());
}

TEST(Cloud, MoreFieldsOrWiderPointsThanDriversSendAreRefused) {
  std::vector<std::string> names{"x", "y", "z"};
  while (names.size() < kMaxCloudFields) names.push_back("extra");
  EXPECT_TRUE(decode_cloud(Message(names, kFloat32, std::vector<float>(names.size(), 1)).m));
  names.push_back("extra");
  EXPECT_FALSE(decode_cloud(Message(names, kFloat32, std::vector<float>(names.size(), 1)).m));
  Message wide({"x", "y", "z"}, kFloat32, std::vector<float>(99, 1));
  wide.m.width = 1;
  wide.m.point_step = wide.m.row_step = kMaxPointBytes;
  EXPECT_TRUE(decode_cloud(wide.m));
  wide.m.point_step = wide.m.row_step = kMaxPointBytes + 4;
  EXPECT_FALSE(decode_cloud(wide.m));
}

TEST(Cloud, OfMorePointsThanTheLargestOrWithABrokenViewpointIsRefused) {
  EXPECT_TRUE(decode_cloud(Message({"x", "y", "z"}, kFloat32, std::vector<float>(3 * kMaxCloudPoints, 1)).m));
  EXPECT_FALSE(decode_cloud(Message({"x", "y", "z"}, kFloat32, std::vector<float>(3 * (kMaxCloudPoints + 1), 1)).m));
  for (const float broken : {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()})
    EXPECT_FALSE(decode_cloud(
        Message({"x", "y", "z", "vp_x", "vp_y", "vp_z"}, kFloat32, std::vector<float>{1, 2, 3, 7, broken, 9}).m));
}

// docs/faults.md row 27: whatever the sizes claim, nothing beyond the data is read.
TEST(Cloud, SizesThatDoNotFitTheDataAreRefused) {
  std::mt19937 random(1);
  int refused = 0;
  for (int round = 0; round < 2000; ++round) {
    Message message({"x", "y", "z"}, kFloat32, std::vector<float>(30, 1));
    const std::uint32_t extreme[] = {0, 1, 3, 10, 11, 12, 120, 1u << 16, 1u << 31, 0xffffffffu};
    auto& m = message.m;
    for (std::uint32_t* size : {&m.width, &m.height, &m.point_step, &m.row_step})
      if (random() % 2) *size = extreme[random() % std::size(extreme)];
    const auto cloud = decode_cloud(m);
    const bool fits = std::uint64_t{m.width} * m.point_step <= m.row_step &&
                      std::uint64_t{m.row_step} * m.height <= 120 && m.point_step >= 12 &&
                      m.point_step <= kMaxPointBytes;
    const bool many = std::uint64_t{m.width} * m.height > kMaxCloudPoints;
    EXPECT_EQ(cloud.has_value(), fits && !many)
        << m.width << " " << m.height << " " << m.point_step << " " << m.row_step;
    refused += !cloud;
  }
  EXPECT_GT(refused, 500);
}

}  // namespace
}  // namespace backwash::daemon

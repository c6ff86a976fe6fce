// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/window_clouds.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "services/backwashd/channels.hpp"

namespace backwash::daemon {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr dds::Guid kMapper{7};
const Vec3 kVehicleAt(1.02, -2.03, 1.24);

config::Daemon told_window() {
  config::Daemon d;
  d.map.window = {"rt/rog_map/occ", "rt/rog_map/free", {4, 4, 2}, 0.1, 1e6};
  return d;
}

/// A cloud of float32 columns, stamped t.
struct Points {
  std::string frame = "map";
  std::vector<std::string> names{"x", "y", "z"};
  std::vector<float> values{};
  double t = 1;
  std::vector<dds::PointField> fields{};
  dds::PointCloud m{};

  void add(const Vec3& p, std::optional<float> more = {}) {
    for (int i = 0; i < 3; ++i) values.push_back(static_cast<float>(p[i]));
    if (more) values.push_back(*more);
  }
  const dds::PointCloud& message() {
    fields.clear();
    for (std::uint32_t n = 0; n < names.size(); ++n) fields.push_back({dds::c_string(names[n]), 4 * n, 7, 1});
    const auto count = static_cast<std::uint32_t>(fields.size()), size = static_cast<std::uint32_t>(4 * values.size());
    m.header.stamp = {static_cast<std::int32_t>(t), static_cast<std::uint32_t>((t - std::floor(t)) * 1e9)};
    m.header.frame_id = dds::c_string(frame);
    m.height = 1;
    m.point_step = 4 * count;
    m.width = size / m.point_step;
    m.row_step = size;
    m.fields = {count, count, fields.data(), false};
    m.data = {size, size, reinterpret_cast<std::uint8_t*>(values.data()), false};
    return m;
  }
};

/// A wall of voxels of edge a, 2 m in front of the vehicle.
Points wall_cloud(double a = 0.1, double off = 0.5, std::optional<float> more = {}) {
  Points points;
  if (more) points.names.emplace_back("intensity");
  for (int j = -3; j <= 3; ++j)
    for (int k = 0; k < 4; ++k)
      points.add({a * (std::floor(2.0 / a) + off), -2 + a * (j + off), 1 + a * (k + off)}, more);
  return points;
}

struct Judged {
  WindowClouds clouds{told_window()};
  std::string refused(Points points, bool free = false, std::optional<Vec3> vehicle = kVehicleAt) {
    const auto cloud = clouds.judge(free, points.message(), kMapper, vehicle, 3);
    if (cloud) return "taken";
    EXPECT_LT(cloud.error().size(), Line{}.size()) << "the status shows it whole: " << cloud.error();
    return cloud.error();
  }
};

TEST(WindowClouds, AreVoxelsOfTheLatticeWithinTheWindowAroundTheVehicle) {
  WindowClouds clouds(told_window());
  Points points = wall_cloud();
  const auto cloud = clouds.judge(false, points.message(), kMapper, kVehicleAt, 3);
  ASSERT_TRUE(cloud) << cloud.error();
  EXPECT_FALSE(cloud->free);
  EXPECT_EQ(cloud->voxels.size(), 28u);
  EXPECT_EQ(cloud->voxels[0], Index3(20, -23, 10));
  EXPECT_EQ(cloud->stamp_ns, 1'000'000'000);
  EXPECT_EQ(cloud->received_ns, 3);
  // Those that meet -0.98 to 3.02 m, -4.03 to -0.03 m, 0.24 to 2.24 m.
  EXPECT_EQ(cloud->window.low, Index3(-10, -41, 2));
  EXPECT_EQ(cloud->window.high, Index3(30, -1, 22));
  EXPECT_FALSE(clouds.beyond());
}

TEST(WindowClouds, PointsOutsideTheWindowFreeNothingAndManyAreTold) {
  WindowClouds clouds(told_window());
  for (const int outside : {2, 14, 15}) {
    Points points = wall_cloud();
    for (int n = 0; n < outside; ++n) points.add(n % 2 ? Vec3(3.15, -2.05, 1.05) : Vec3(1.05, -2.05, 2.35));
    const auto cloud = clouds.judge(true, points.message(), kMapper, kVehicleAt, 3);
    ASSERT_TRUE(cloud) << cloud.error();
    EXPECT_EQ(cloud->voxels.size(), 28u);
    for (const Index3& v : cloud->voxels) EXPECT_TRUE(cloud->window.contains(v));
    EXPECT_EQ(clouds.beyond().has_value(), outside == 15) << "two of three and more are within";
  }
  EXPECT_THAT(*clouds.beyond(), AllOf(HasSubstr("rt/rog_map/free"), HasSubstr("15 of 43 points lie outside"),
                                      HasSubstr("4 x 4 x 2 m"), HasSubstr("map.window.size_x")));
  Judged judged;
  EXPECT_THAT(judged.refused(wall_cloud(), false, Vec3(100, 0, 1)), HasSubstr("28 of 28 points lie outside"));
  EXPECT_EQ(judged.refused(wall_cloud(), false, kVehicleAt - Vec3(1.5, 0, 0)), "taken")
      << "nothing is within, and it is near";
}

// Topic, sender, field, value seen and wanted, and the setting.
TEST(WindowClouds, AnotherFrameIsRefusedByName) {
  Points points = wall_cloud();
  points.frame = "camera_init";
  EXPECT_THAT(Judged().refused(points), AllOf(HasSubstr("rt/rog_map/occ of writer 07000000"),
                                              HasSubstr("header.frame_id 'camera_init', wanted 'map' (frames.map)")));
}

// Two processes, each with a clock of its own.
TEST(WindowClouds, AFreeCloudWhoseClockIsAheadOfTheOccupiedOnesIsRefusedByName) {
  constexpr dds::Guid kOther{8};
  WindowClouds clouds(told_window());
  const auto at = [&](bool free, double stamp, double received) -> std::string {
    Points points = wall_cloud();
    points.t = stamp;
    const auto cloud = clouds.judge(free, points.message(), free ? kOther : kMapper, kVehicleAt,
                                    static_cast<std::int64_t>(std::lround(received * 1e9)));
    return cloud ? "taken" : cloud.error();
  };
  EXPECT_EQ(at(true, 500, 99), "taken") << "nothing is occupied yet";
  clouds.forget(true);
  EXPECT_EQ(at(false, 100, 100.05), "taken");
  EXPECT_EQ(at(false, 100.1, 100.75), "taken") << "one that took longer";
  const std::string why = at(true, 110, 100.8);
  EXPECT_THAT(why, AllOf(HasSubstr("rt/rog_map/free of writer 08000000"), HasSubstr("its clock is 9.25 s ahead"),
                         HasSubstr("that of rt/rog_map/occ, or those come so much later")));
  EXPECT_EQ(at(true, 101.7, 100.8), "taken") << "within what latencies differ by";
  EXPECT_EQ(at(true, 101.8, 104.9), "taken") << "late ones free less";
  clouds.forget(false);
  EXPECT_THAT(at(true, 110, 104.9), HasSubstr("ahead of that of")) << "until another mapper has spoken";
  EXPECT_EQ(at(false, 200, 105), "taken") << "another mapper's clock";
  EXPECT_EQ(at(true, 200, 105.1), "taken");
}

TEST(WindowClouds, AnotherResolutionIsRefusedByNameWhetherFinerOrCoarser) {
  EXPECT_THAT(Judged().refused(wall_cloud(0.05)),
              HasSubstr("its points lie 0.05 m apart, wanted 0.1 m (map.window.resolution"));
  EXPECT_THAT(Judged().refused(wall_cloud(0.2)), HasSubstr("its points lie 0.2 m apart"));
  // Of an odd multiple every centre is a centre of ours.
  EXPECT_THAT(Judged().refused(wall_cloud(0.3)), HasSubstr("its points lie 0.3 m apart"));
  EXPECT_THAT(Judged().refused(wall_cloud(0.1, 0.0)),
              AllOf(HasSubstr("0.05 m off a voxel's centre"), HasSubstr("ORIGIN_AT_CORNER")));
  Points few;
  for (int n = 0; n < 3; ++n) few.add({0.05 + 0.3 * n, -2.05, 1.05});
  EXPECT_EQ(Judged().refused(few), "taken") << "three voxels tell no lattice";
}

TEST(WindowClouds, DistancesAreNoVoxelsAndAreRefusedByTheField) {
  // voxblox's tsdf_pointcloud and esdf_slice, nvblox's static_esdf_pointcloud: intensity is the distance.
  Points slice = wall_cloud(0.1, 0.5, 0.7f);
  slice.values[3] = 0.05f;
  slice.values[7] = 2.0f;
  for (const bool free : {false, true})
    EXPECT_THAT(Judged().refused(slice, free), AllOf(HasSubstr("field intensity 0.05 to 2 looks like distances"),
                                                     HasSubstr(free ? "map.window.free" : "map.window.occupied")));
  EXPECT_THAT(Judged().refused(wall_cloud(0.1, 0.5, -0.1f)), HasSubstr("looks like distances"));
  EXPECT_THAT(Judged().refused(wall_cloud(0.1, 0.5, std::numeric_limits<float>::quiet_NaN())),
              HasSubstr("looks like distances"));
  Points named = wall_cloud(0.1, 0.5, 0.7f);
  named.names[3] = "distance";
  EXPECT_THAT(Judged().refused(named), HasSubstr("field distance 0.7 to 0.7"));
  // nvblox's static_occupancy: the probability of what is occupied. Of free voxels it says nothing.
  EXPECT_EQ(Judged().refused(wall_cloud(0.1, 0.5, 0.97f)), "taken");
  EXPECT_EQ(Judged().refused(wall_cloud(0.1, 0.5, 0.0f)), "taken") << "XYZI that nobody fills";
  EXPECT_THAT(Judged().refused(wall_cloud(0.1, 0.5, 0.97f), true), HasSubstr("looks like distances"));
}

TEST(WindowClouds, PointsThatAreNotFiniteAreRefused) {
  Points points = wall_cloud();
  points.values[4] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(Judged().refused(points), HasSubstr("x, y, z: 1 points are not finite"));
  Points far = wall_cloud();
  far.values[4] = 3e37f;
  EXPECT_THAT(Judged().refused(far), HasSubstr("beyond any map"));
}

TEST(WindowClouds, AnOlderCloudOfItsKindIsRefusedUntilItsWriterIsGone) {
  Judged judged;
  Points newer = wall_cloud(), older = wall_cloud();
  newer.t = 2;
  EXPECT_EQ(judged.refused(newer), "taken");
  EXPECT_EQ(judged.refused(older, true), "taken") << "of the other kind";
  EXPECT_THAT(judged.refused(older), HasSubstr("header.stamp 1 s before the one before it"));
  EXPECT_EQ(judged.refused(newer), "taken") << "the same stamp again";
  judged.clouds.forget(false);
  const auto first = judged.clouds.judge(false, older.message(), kMapper, kVehicleAt, 3);
  ASSERT_TRUE(first) << first.error();
  EXPECT_TRUE(first->first) << "of another mapper: stamps before it say nothing of it";
  EXPECT_FALSE(judged.clouds.judge(false, older.message(), kMapper, kVehicleAt, 3)->first);
}

TEST(WindowClouds, ACloudThatIsNoneOrTooLargeOrBeforeTheFirstOdometryIsRefused) {
  EXPECT_THAT(Judged().refused(wall_cloud(), false, std::nullopt), HasSubstr("before the first odometry"));
  Points points = wall_cloud();
  points.names[2] = "w";
  EXPECT_THAT(Judged().refused(points), HasSubstr("fields x, y, z"));
  Points large;
  for (int n = 0; n < 2 * 41 * 41 * 21 + 1; ++n) large.add({0.05, -2.05, 1.05});
  EXPECT_THAT(Judged().refused(large), AllOf(HasSubstr("70603 points, at most 70602"), HasSubstr("map.window.size_x")));
  EXPECT_EQ(Judged().refused(Points{}), "taken") << "nothing is occupied";
}

TEST(WindowClouds, NewVoxelsAreThoseThatAreFreeInTheSnapshot) {
  map::OccupancyGrid known({0, -3, 0}, 0.1, {40, 40, 30}, map::Cell::free);
  known.set(known.index({2.05, -2.25, 1.05}), map::Cell::occupied);
  known.set(known.index({2.05, -2.25, 1.15}), map::Cell::unknown);
  WindowClouds clouds(told_window());
  Points points = wall_cloud();
  const NewVoxels voxels = new_voxels(known, clouds.judge(false, points.message(), kMapper, kVehicleAt, 3).value());
  EXPECT_EQ(voxels.count, 26u);
  EXPECT_EQ(voxels.received_ns, 3);
  EXPECT_DOUBLE_EQ(voxels.edge, 0.1);
}

}  // namespace
}  // namespace backwash::daemon

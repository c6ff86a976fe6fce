// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/cloud.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>

namespace backwash::daemon {
namespace {

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

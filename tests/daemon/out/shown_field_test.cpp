// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/out/shown_field.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"

namespace backwash::daemon {
namespace {

const plan::World& apartment() {
  static const auto world =
      plan::build_world(map::builtin_scene("apartment", 0.2).value(), config::load_model("builtin:quad-5in").value(),
                        config::load_vehicle("builtin:quad-5in").value());
  return *world;
}

TEST(ShownField, HasTheBoundsOfTheVehiclesLayerAndNoOthers) {
  const Vec3 vehicle_W(3, 4.2, 1.25);
  const ShownField shown(apartment(), vehicle_W, "map");
  const auto& cloud = shown.cloud();
  EXPECT_STREQ(cloud.header.frame_id, "map");
  ASSERT_EQ(cloud.point_step, 20u);
  ASSERT_EQ(cloud.data._length, cloud.width * 20);
  const auto& grid = apartment().grid;
  const int layer = grid.index(vehicle_W).z();
  std::size_t expected = 0, found = 0;
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    expected += grid.voxel(n).z() == layer && apartment().bounds.at(grid.voxel(n)).w[kZ] > 0;
  for (std::uint32_t n = 0; n < cloud.width; ++n) {
    float point[5];
    std::memcpy(point, cloud.data._buffer + n * 20, 20);
    const Index3 v = grid.index(Vec3(point[0], point[1], point[2]));
    ASSERT_EQ(v.z(), layer);
    const auto w = apartment().bounds.at(v).w;
    EXPECT_FLOAT_EQ(point[3], static_cast<float>(std::max({w[kX], w[kY], w[kXyPlus], w[kXyMinus]})));
    EXPECT_FLOAT_EQ(point[4], static_cast<float>(w[kZ]));
    found += point[4] > 0;
  }
  EXPECT_GT(expected, 500u);
  EXPECT_EQ(found, expected);  // the apartment is no wider than what is shown
}

TEST(ShownField, EndsAtItsDistanceAndIsEmptyBesideTheMap) {
  const auto& grid = apartment().grid;
  const Vec3 beside = grid.origin() - Vec3(ShownField::kAround, 0, 0) + Vec3(2, 3, 1.2);
  const ShownField part(apartment(), beside, "map");
  ASSERT_GT(part.cloud().width, 10u);
  for (std::uint32_t n = 0; n < part.cloud().width; ++n) {
    float x;
    std::memcpy(&x, part.cloud().data._buffer + n * 20, 4);
    EXPECT_LE(x, beside.x() + ShownField::kAround + grid.resolution());
  }
  for (const Vec3& outside : {Vec3(3, 4, -50), Vec3(3, 4, 50), Vec3(500, 4, 1), Vec3(-500, -500, 1)})
    EXPECT_EQ(ShownField(apartment(), outside, "map").cloud().width, 0u);
}

TEST(FieldShows, AtAnotherWorldLayerOrPlaceOnceASecond) {
  constexpr std::int64_t s = 1'000'000'000;
  const auto other = std::make_unique<plan::World>(apartment());
  FieldShows shows;
  std::int64_t now = 5 * s;
  const Vec3 p(3, 4.2, 1.25);
  EXPECT_TRUE(shows.due(apartment(), p, now));
  EXPECT_FALSE(shows.due(*other, p, now + s / 2));  // too soon
  EXPECT_FALSE(shows.due(apartment(), p + Vec3(0.9, 0, 0), now += 2 * s));
  EXPECT_TRUE(shows.due(apartment(), p + Vec3(1.1, 0, 0), now += 2 * s));
  EXPECT_TRUE(shows.due(apartment(), p + Vec3(1.1, 0, 0.2), now += 2 * s));
  EXPECT_FALSE(shows.due(apartment(), p + Vec3(1.1, 0, 0.2), now += 2 * s));
  EXPECT_TRUE(shows.due(*other, p + Vec3(1.1, 0, 0.2), now += 2 * s));
}

}  // namespace
}  // namespace backwash::daemon

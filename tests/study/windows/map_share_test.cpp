// SPDX-License-Identifier: BSD-3-Clause
// Whether a flight lies where its map lets a craft be: of its own map it does, of another one it does not.
#include "core/study/windows/map_share.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/config/config.hpp"

namespace backwash::study {
namespace {

/// A room of 6 × 4 × 2.5 m from `low` on, walls and floor of one voxel, a box of 1 m in a corner.
map::OccupancyGrid room(const Vec3& low, bool mirrored) {
  constexpr double a = 0.1;
  map::OccupancyGrid grid(low - Vec3::Constant(a), a, {62, 42, 26}, map::Cell::free);
  for (int k = 0; k < 26; ++k)
    for (int j = 0; j < 42; ++j)
      for (int i = 0; i < 62; ++i) {
        const int x = mirrored ? 61 - i : i;
        if (i == 0 || i == 61 || j == 0 || j == 41 || k == 0 || (x > 40 && j > 20 && k < 18))
          grid.set({i, j, k}, map::Cell::occupied);
      }
  return grid;
}

/// 40 s through the free part of room({0, 0, 0}, false), from the floor and back to it.
log::FlightLog flown() {
  log::FlightLog log;
  for (int k = 0; k < 2000; ++k) {
    const double t = 0.02 * k, up = std::min({1.0, t / 3, (40 - t) / 3});
    log.t_s.push_back(t);
    log.columns["x_m"].push_back(2 - 1.6 * std::cos(0.3 * t));
    log.columns["y_m"].push_back(2 + 1.6 * std::sin(0.3 * t));
    log.columns["z_m"].push_back(1.2 * up - 0.02);
  }
  return log;
}

const Vehicle& vehicle_flown() {
  static const Vehicle vehicle = config::load_vehicle("builtin:quad-5in").value();
  return vehicle;
}

TEST(MapShare, OfItsOwnMapAFlightFromFloorToFloorHasNone) {
  const auto share = map_share(flown(), room(Vec3::Zero(), false), vehicle_flown());
  EXPECT_EQ(share.all(), 0);
  EXPECT_FALSE(share.refused());
  EXPECT_FALSE(share.first);
}

TEST(MapShare, OfAMirroredMapOrOneThatIsShiftedItIsRefusedWithItsFirstPlace) {
  const auto mirrored = map_share(flown(), room(Vec3::Zero(), true), vehicle_flown());
  EXPECT_TRUE(mirrored.refused());
  EXPECT_GT(mirrored.inside, 0.02);
  ASSERT_TRUE(mirrored.first);
  for (const Vec3& by : {Vec3(2, 0, 0), Vec3(0, -2, 0), Vec3(0, 0, 2), Vec3(30, 0, 0)}) {
    const auto share = map_share(flown(), room(by, false), vehicle_flown());
    EXPECT_TRUE(share.refused()) << by.transpose();
    EXPECT_LE(share.all(), 1 + 1e-12);
  }
  EXPECT_NEAR(map_share(flown(), room({0, 0, 50}, false), vehicle_flown()).outside, 1, 1e-12);
}

TEST(MapShare, WhatTheMapDoesNotKnowIsOutside) {
  auto grid = room(Vec3::Zero(), false);
  for (int k = 0; k < 26; ++k)
    for (int j = 1; j < 41; ++j)
      for (int i = 1; i < 20; ++i) grid.set({i, j, k}, map::Cell::unknown);
  const auto share = map_share(flown(), grid, vehicle_flown());
  EXPECT_GT(share.outside, 0.3);
  EXPECT_EQ(share.inside, 0);
}

TEST(MapShare, AWallThatThePathCrossesIsFoundAndOneBesideItIsNot) {
  auto grid = room(Vec3::Zero(), false);
  for (int k = 1; k < 26; ++k)
    for (int j = 10; j < 14; ++j) grid.set({20, j, k}, map::Cell::occupied);
  EXPECT_EQ(map_share(flown(), grid, vehicle_flown()).all(), 0);
  for (int k = 1; k < 26; ++k)
    for (int j = 1; j < 41; ++j) grid.set({20, j, k}, map::Cell::occupied);
  const auto share = map_share(flown(), grid, vehicle_flown());
  EXPECT_TRUE(share.refused());
  EXPECT_GT(share.inside, 0);
}

TEST(MapShare, PlacesFarAwayOrNotFiniteAreOutside) {
  auto log = flown();
  log.columns["x_m"][10] = 1e300;
  log.columns["y_m"][11] = std::nan("");
  const auto share = map_share(log, room(Vec3::Zero(), false), vehicle_flown());
  EXPECT_NEAR(share.outside, 2 / 2000.0, 1e-12);
  EXPECT_FALSE(share.refused());
  ASSERT_TRUE(share.first);
  EXPECT_NEAR(share.first->t_s, 0.2, 1e-12);
}

}  // namespace
}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
// What the study sees of a map: against the exact field, and against a room that is made here.
#include <gtest/gtest.h>

#include <cmath>

#include "core/config/config.hpp"
#include "core/study/windows/surroundings.hpp"

namespace {

using namespace backwash::study;
using backwash::kNoSurface;
using backwash::Vec3;

/// A room of 3 m by 3 m by 2.6 m whose ceiling is at 1.8 m up to x = 1.2 m.
backwash::map::OccupancyGrid with_a_lowered_ceiling() {
  using backwash::map::Cell;
  backwash::map::OccupancyGrid grid(Vec3::Zero(), 0.1, {30, 30, 26}, Cell::free);
  for (int i = 0; i < 30; ++i)
    for (int j = 0; j < 30; ++j)
      for (int k = 0; k < 26; ++k)
        if (i == 0 || j == 0 || i == 29 || j == 29 || k == 0 || k == 25 || (i < 12 && k >= 18))
          grid.set({i, j, k}, Cell::occupied);
  return grid;
}

TEST(MapView, TheVarianceBesideASolidIsThatOfTheAirAndNotThatWithinTheSolid) {
  const auto grid = with_a_lowered_ceiling();
  const auto model = backwash::config::load_model("builtin:quad-5in").value();
  const backwash::field::ProximityField exact(grid, model);
  MapView view(&grid, model);
  for (const double beside : {0.03, 0.06, 0.1}) {
    const Vec3 p(1.2 + beside, 1.05, 2.15);
    const auto there = exact.at(p).sigma();
    EXPECT_NEAR(std::log(view.sigma(p).sum() / (there.xx + there.yy + there.zz)), 0, 0.4) << beside;
  }
}

TEST(MapView, TheSideOfALoweredCeilingIsAWallButNotFromFloorToCeiling) {
  const auto grid = with_a_lowered_ceiling();
  MapView around(&grid, backwash::config::load_model("builtin:quad-5in").value());
  const PlaceAround high = around.around({1.55, 1.05, 2.15}), low = around.around({1.55, 1.05, 1.0});
  const auto nearest_along = [](const auto& walls, const Vec3& direction) {
    double least = kNoSurface;
    for (const auto& [distance, towards_it] : walls)
      if (towards_it.dot(direction) > 0.9) least = std::min(least, distance);
    return least;
  };
  EXPECT_NEAR(nearest_along(high.walls, -Vec3::UnitX()), 0.35, 1e-6);
  EXPECT_EQ(nearest_along(high.whole_walls, -Vec3::UnitX()), kNoSurface);
  EXPECT_NEAR(nearest_along(low.whole_walls, -Vec3::UnitX()), 1.45, 1e-6);
  EXPECT_NEAR(nearest_along(high.whole_walls, -Vec3::UnitY()), 0.95, 1e-6);
}

}  // namespace

// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/scan/regrid.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>
#include <sstream>

#include "core/map/lattice_box.hpp"
#include "core/map/octomap/octomap_file.hpp"
#include "tests/map/liboctomap.hpp"

namespace backwash::map {
namespace {

OccupancyGrid random_cells(std::uint64_t seed, const Index3& size, double resolution) {
  std::mt19937_64 random(seed);
  OccupancyGrid grid(resolution * Vec3(-3, 2, -1), resolution, size);
  for (std::size_t i = 0; i < grid.cell_count(); ++i)
    grid.set(grid.voxel(i), random() % 10 < 8 ? Cell::free : static_cast<Cell>(random() % 3));
  return grid;
}

OccupancyGrid placed(const OccupancyGrid& source, const Placement& place, double resolution) {
  const auto box =
      placed_box(place, source.origin(), source.origin() + source.resolution() * source.size().cast<double>());
  auto grid = grid_around(box.first, box.second, resolution);
  regrid(source, place, *grid);
  return *grid;
}

TEST(Regrid, MovesEveryVoxelOfAQuarterTurnAndAShiftByWholeVoxels) {
  const auto source = random_cells(1, {7, 9, 5}, 0.1);
  Placement place;
  place.R_W << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  place.origin = {0.3, -0.7, 12.1};
  const auto target = placed(source, place, 0.1);
  EXPECT_EQ(target.size(), Index3(9, 7, 5));
  for (std::size_t i = 0; i < source.cell_count(); ++i)
    ASSERT_EQ(target.at(target.index(place(source.center(source.voxel(i))))), source.at(i));
}

TEST(Regrid, MakesACoarseVoxelTheWorstOfThoseInIt) {
  const auto source = random_cells(2, {12, 9, 6}, 0.1);
  const auto target = placed(source, {}, 0.3);
  std::vector<Cell> expected(target.cell_count(), Cell::free);
  const auto rank = [](Cell c) { return c == Cell::free ? 0 : c == Cell::unknown ? 1 : 2; };
  for (std::size_t n = 0; n < target.cell_count(); ++n)
    for (int i = 0; i < 27; ++i) {
      const Vec3 p = target.center(target.voxel(n)) + 0.1 * Vec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      const Cell cell = source.at(source.index(p));
      if (rank(cell) > rank(expected[n])) expected[n] = cell;
    }
  for (std::size_t n = 0; n < target.cell_count(); ++n) ASSERT_EQ(target.at(n), expected[n]) << n;
}

TEST(Regrid, GivesAFinerGridWhatItsVoxelsWere) {
  const auto source = random_cells(3, {5, 4, 6}, 0.2);
  const auto target = placed(source, {}, 0.05);
  EXPECT_EQ(target.size(), Index3(20, 16, 24));
  for (std::size_t n = 0; n < target.cell_count(); ++n)
    ASSERT_EQ(target.at(n), source.at(source.index(target.center(target.voxel(n)))));
}

TEST(Regrid, CallsNoPlaceFreeThatWasNotByAnyTurnScaleOrResolution) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int round = 0; round < 30; ++round) {
    const auto source = random_cells(10 + static_cast<std::uint64_t>(round), {14, 14, 14}, 0.1);
    Placement place{1.7 + unit(random),
                    Eigen::Quaterniond::UnitRandom().toRotationMatrix(),
                    {unit(random), unit(random), unit(random)}};
    const auto target = placed(source, place, 0.08);
    for (int n = 0; n < 4000; ++n) {
      const Vec3 share = 0.5 * (Vec3(unit(random), unit(random), unit(random)) + Vec3::Ones());
      const Vec3 p = source.origin() + 1.4 * share;
      const Cell here = source.at(source.index(p)), there = target.at(target.index(place(p)));
      // The share of a voxel that only touches is no place to ask.
      const Vec3 q = (p - source.origin()) / 0.1;
      if (((q.array() - q.array().round()).abs() < 0.01).any()) continue;
      if (here == Cell::occupied) {
        ASSERT_EQ(there, Cell::occupied);
      }
      if (here == Cell::unknown) {
        ASSERT_NE(there, Cell::free);
      }
    }
  }
}

TEST(GridAround, HoldsTheBoxWithoutALayerForWhatLiesOnAFace) {
  const auto grid = grid_around({0.1f, -0.25, 0.3}, {1.3f, 0.25, 0.3}, 0.1);
  ASSERT_TRUE(grid);
  EXPECT_EQ(grid->size(), Index3(12, 6, 1));
  EXPECT_NEAR((grid->origin() - Vec3(0.1, -0.3, 0.3)).norm(), 0, 1e-12);
}

TEST(GridAround, RefusesTooManyVoxelsWithAResolutionThatFits) {
  const auto refused = grid_around({0, 0, 0}, {100, 80, 10}, 0.01, 1 << 20);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().find("100 x 80 x 10 m are 8e+10 voxels"), std::string::npos) << refused.error();
  const double fits = std::stod(refused.error().substr(refused.error().find("--resolution ") + 13));
  EXPECT_LT(fits, 0.6);
  EXPECT_TRUE(grid_around({0, 0, 0}, {100, 80, 10}, fits, 1 << 20));
}

TEST(GridAround, RefusesWhatOctoMapCannotReachWithAnOriginThatItCan) {
  const Vec3 low(500000, 5.6e6, 100), high = low + Vec3(20, 20, 3);
  const auto refused = grid_around(low, high, 0.1);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().find("--origin 500010,5600010,10"), std::string::npos) << refused.error();
  EXPECT_TRUE(grid_around(low - Vec3(500010, 5600010, 102), high - Vec3(500010, 5600010, 102), 0.1));
}

TEST(OctomapFile, IsReadByLiboctomapAsTheSameMap) {
  const auto grid = random_cells(5, {9, 17, 6}, 0.05);
  std::stringstream file(octomap_file(grid));
  octomap::OcTree tree(1);
  ASSERT_TRUE(tree.readBinary(file));
  EXPECT_EQ(tree.getResolution(), 0.05);
  for (std::size_t i = 0; i < grid.cell_count(); ++i) ASSERT_EQ(cell_of(tree, grid.center(grid.voxel(i))), grid.at(i));
}

}  // namespace
}  // namespace backwash::map

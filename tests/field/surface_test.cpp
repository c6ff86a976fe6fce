// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "core/field/surface.hpp"
#include "tests/field/brute_force.hpp"
#include "tests/field/scenes.hpp"

namespace backwash::field {
namespace {

using map::Cell;
using map::OccupancyGrid;

std::vector<Element> lateral(const OccupancyGrid& grid) {
  std::vector<Element> elements = surface_elements(grid);
  std::erase_if(elements, [](const Element& e) { return e.kind == Element::Kind::up; });
  return elements;
}

TEST(Surface, EqualsBruteForceOnRandomMaps) {
  std::size_t oblique = 0, corners = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const OccupancyGrid grid = scene::random_map(seed, 0.13);
    const auto elements = surface_elements(grid);
    const auto expected = oracle::pieces(grid);
    ASSERT_EQ(elements.size(), expected.size()) << "seed " << seed;
    for (std::size_t n = 0; n < elements.size(); ++n) {
      ASSERT_EQ(elements[n].kind == Element::Kind::up, expected[n].up);
      ASSERT_LT((elements[n].c_W - expected[n].c).norm(), 1e-12);
      ASSERT_LT((elements[n].normal - expected[n].m).norm(), 1e-12);
      ASSERT_NEAR(elements[n].area, expected[n].A, 1e-14);
      ASSERT_EQ(elements[n].corner_W.has_value(), expected[n].k.has_value());
      if (expected[n].k) {
        ASSERT_LT((*elements[n].corner_W - *expected[n].k).norm(), 1e-12);
      }
      oblique += std::abs(expected[n].m.x() * expected[n].m.y()) > 0.01;
      corners += expected[n].k.has_value();
    }
  }
  EXPECT_GT(oblique, 1000u);
  EXPECT_GT(corners, 1000u);
}

TEST(Surface, FlatWallGivesOneElementPerVoxelWithAreaOfItsFaceAndTheFloorBelowAsCorner) {
  const double a = 0.1;
  OccupancyGrid grid(Vec3::Zero(), a, Index3(12, 12, 9), Cell::free);
  scene::paint(grid, Cell::occupied, [](const Vec3& x) { return x.x() > 0.7 || x.z() < 0.1; });
  int checked = 0;
  for (const Element& e : lateral(grid)) {
    if (e.normal.x() > -0.999 || e.c_W.y() < 0.25 || e.c_W.y() > 0.95) continue;  // the border sees unknown space
    if (e.c_W.z() < 0.25) continue;  // the floor tilts no horizontal normal
    ++checked;
    EXPECT_NEAR(e.c_W.x(), 0.7, 1e-12);
    EXPECT_NEAR(e.area, a * a, 1e-14);
    ASSERT_TRUE(e.corner_W);
    EXPECT_LT((*e.corner_W - Vec3(0.7, e.c_W.y(), 0.1)).norm(), 1e-12);
  }
  EXPECT_EQ(checked, 7 * 7);
}

TEST(Surface, OneVoxelWallGivesBothFaces) {
  OccupancyGrid grid(Vec3::Zero(), 1, Index3(9, 9, 9), Cell::free);
  for (int j = 0; j < 9; ++j)
    for (int k = 0; k < 9; ++k) grid.set(Index3(4, j, k), Cell::occupied);
  int plus = 0, minus = 0;
  for (const Element& e : lateral(grid)) {
    EXPECT_EQ(e.area, 1);
    if (e.normal == Vec3(1, 0, 0) && e.c_W.x() == 5) ++plus;
    if (e.normal == Vec3(-1, 0, 0) && e.c_W.x() == 4) ++minus;
  }
  EXPECT_EQ(plus, 81);
  EXPECT_EQ(minus, 81);
}

TEST(Surface, ConvexEdgeAtFortyFiveDegreesTakesTheXFaceForItsCorner) {
  // A quarter space x > 4, y > 4 on a floor that is 1 higher beside the x face than beside the y face.
  OccupancyGrid grid(Vec3::Zero(), 1, Index3(9, 9, 9), Cell::free);
  scene::paint(grid, Cell::occupied,
               [](const Vec3& x) { return (x.x() > 4 && x.y() > 4) || x.z() < 1 || (x.x() < 4 && x.z() < 2); });
  int found = 0;
  for (const Element& e : lateral(grid))
    if ((e.c_W - Vec3(4.5 - std::sqrt(0.125), 4.5 - std::sqrt(0.125), 5.5)).norm() < 1e-9) {
      ++found;
      EXPECT_NEAR(e.area, std::sqrt(2.0), 1e-12);
      ASSERT_TRUE(e.corner_W);
      EXPECT_NEAR(e.corner_W->z(), 2, 1e-12);  // +x is not exposed, so the order +x, −x, +y, −y gives −x before −y
    }
  EXPECT_EQ(found, 1);
}

TEST(Surface, NeedsFreeNeighbours) {
  OccupancyGrid grid(Vec3::Zero(), 1, Index3(5, 5, 5), Cell::unknown);
  grid.set(Index3(2, 2, 2), Cell::occupied);
  grid.set(Index3(4, 4, 4), Cell::occupied);  // beside the outside
  EXPECT_TRUE(surface_elements(grid).empty());
  grid.set(Index3(2, 2, 3), Cell::free);
  ASSERT_EQ(surface_elements(grid).size(), 1u);
  EXPECT_EQ(surface_elements(grid)[0].c_W, Vec3(2.5, 2.5, 3));
}

TEST(Surface, HasNoCornerAboveUnknownSpaceOrTheEndOfTheMap) {
  OccupancyGrid grid(Vec3::Zero(), 1, Index3(7, 7, 7), Cell::free);
  scene::paint(grid, Cell::occupied, [](const Vec3& x) { return x.x() > 4; });
  ASSERT_FALSE(lateral(grid).empty());
  for (const Element& e : lateral(grid)) EXPECT_FALSE(e.corner_W);
  scene::paint(grid, Cell::unknown, [](const Vec3& x) { return x.z() < 2; });
  ASSERT_FALSE(lateral(grid).empty());
  for (const Element& e : lateral(grid)) EXPECT_FALSE(e.corner_W);
}

}  // namespace
}  // namespace backwash::field

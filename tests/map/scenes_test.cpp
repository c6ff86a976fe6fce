// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/map/distance_field.hpp"
#include "core/map/load_map.hpp"

namespace backwash::map {
namespace {

constexpr double kClearance = 0.45;  // m: body 0.22, hover set 0.15 and some

OccupancyGrid scene(const std::string& name, double resolution = 0.1) {
  return builtin_scene(name, resolution).value();
}

/// Distance from p along an axis to the face where free space ends, m. Steps through voxels.
double free_run(const OccupancyGrid& grid, const Vec3& p, int axis, int sign) {
  Index3 v = grid.index(p);
  while (grid.free(v)) v[axis] += sign;
  const double face = grid.center(v)[axis] - sign * grid.resolution() / 2;
  return sign * (face - p[axis]);
}

double free_width(const OccupancyGrid& grid, const Vec3& p, int axis) {
  return free_run(grid, p, axis, 1) + free_run(grid, p, axis, -1);
}

/// Whether a flood fill of the voxels farther than `clearance` from any obstacle leads from one point to the other.
bool connected(const OccupancyGrid& grid, const Vec3& from, const Vec3& to, double clearance = kClearance) {
  const DistanceField distance(grid);
  const auto open = [&](const Index3& v) { return distance.at(v) > std::max(clearance - 1e-6, 0.0); };
  if (!open(grid.index(from)) || !open(grid.index(to))) return false;
  std::vector<bool> seen(grid.cell_count());
  std::vector<Index3> edge{grid.index(from)};
  seen[grid.linear(edge.front())] = true;
  while (!edge.empty()) {
    const Index3 v = edge.back();
    edge.pop_back();
    for (int axis = 0; axis < 3; ++axis) {
      for (const int sign : {-1, 1}) {
        const Index3 next = v + sign * Index3::Unit(axis);
        if (!open(next) || seen[grid.linear(next)]) continue;
        seen[grid.linear(next)] = true;
        edge.push_back(next);
      }
    }
  }
  return seen[grid.linear(grid.index(to))];
}

void block(OccupancyGrid& grid, const Vec3& low, const Vec3& high) {
  for (std::size_t i = 0; i < grid.cell_count(); ++i) {
    const Vec3 c = grid.center(grid.voxel(i));
    if ((c.array() > low.array()).all() && (c.array() < high.array()).all()) grid.set(grid.voxel(i), Cell::occupied);
  }
}

/// The routes of README.md.
struct Route {
  std::string name;
  Vec3 start, goal;
};
const std::vector<Route> kRoutes = {
    {"parallel-walls-4m", {-2, 0, 1.2}, {2, 0, 1.2}}, {"parallel-walls-2m", {-2, 0, 1.2}, {2, 0, 1.2}},
    {"parallel-walls-1m", {-2, 0, 1.2}, {2, 0, 1.2}}, {"narrow-gap", {1, 0, 1.2}, {5, 0, 1.2}},
    {"corridors", {0.8, 4, 1.2}, {6.5, 4, 1.2}},      {"apartment", {3, 4, 1.2}, {7.2, 1.8, 1.2}},
    {"apartment", {3, 4, 1.2}, {7.6, 5.6, 1.2}},      {"apartment", {7.2, 1.8, 1.2}, {7.6, 5.6, 1.2}},
    {"thin-wall", {2, -2, 1.2}, {8, -2, 1.2}},        {"forest-1", {-19, 0, 1.2}, {19, 0, 1.2}},
    {"forest-2", {-19, 0, 1.2}, {19, 0, 1.2}},        {"forest-18446744073709551615", {-19, 0, 1.2}, {19, 0, 1.2}}};

TEST(Scenes, AreKnownThroughout) {
  for (const auto& route : kRoutes) {
    const auto grid = scene(route.name);
    EXPECT_TRUE(std::ranges::none_of(grid.cells(), [](Cell c) { return c == Cell::unknown; })) << route.name;
    EXPECT_TRUE(std::ranges::any_of(grid.cells(), [](Cell c) { return c == Cell::occupied; })) << route.name;
  }
}

TEST(Scenes, HaveARouteWithClearance) {
  for (const auto& route : kRoutes) {
    EXPECT_TRUE(connected(scene(route.name), route.start, route.goal)) << route.name;
  }
}

TEST(Scenes, AreTheSameWorldAtBothResolutions) {
  for (const auto& route : kRoutes) {
    if (route.name.starts_with("forest")) continue;  // its rings are round
    const auto coarse = scene(route.name, 0.1);
    const auto fine = scene(route.name, 0.05);
    for (std::size_t i = 0; i < fine.cell_count(); ++i) {
      const Vec3 c = fine.center(fine.voxel(i));
      ASSERT_EQ(fine.at(i), coarse.at(coarse.index(c))) << route.name << " at " << c.transpose();
    }
  }
}

TEST(Scenes, CorridorsHaveTheirWidthsAndNothingElseIsOpen) {
  for (const double a : {0.05, 0.1}) {
    const auto grid = scene("corridors", a);
    EXPECT_NEAR(free_width(grid, {0.81, 4.02, 1.21}, 0), 1.6, 1e-9);
    EXPECT_NEAR(free_width(grid, {6.51, 4.02, 1.21}, 0), 1.0, 1e-9);
    EXPECT_NEAR(free_width(grid, {13.31, 4.02, 1.21}, 0), 1.4, 1e-9);
    EXPECT_NEAR(free_width(grid, {3.01, 0.62, 1.21}, 1), 1.2, 1e-9);
    EXPECT_NEAR(free_width(grid, {3.01, 7.32, 1.21}, 1), 1.4, 1e-9);
    EXPECT_NEAR(free_width(grid, {3.01, 0.62, 1.21}, 2), 2.5, 1e-9);
    const auto free = static_cast<double>(std::ranges::count(grid.cells(), Cell::free)) * a * a * a;
    EXPECT_NEAR(free, (14 * 8 - (4.4 + 5.6) * 5.4) * 2.5, 1e-6);
  }
}

TEST(Scenes, ParallelWallsFaceEachOtherAtTheirNominalDistance) {
  for (const double a : {0.05, 0.1}) {
    for (const int d : {1, 2, 4}) {
      const auto grid = scene("parallel-walls-" + std::to_string(d) + "m", a);
      for (const double z : {0.01, 1.2, 2.49}) {
        EXPECT_NEAR(free_run(grid, {0.03, 0, z}, 1, 1), d / 2.0, 1e-9);
        EXPECT_NEAR(free_run(grid, {0.03, 0, z}, 1, -1), d / 2.0, 1e-9);
        EXPECT_NEAR(free_width(grid, {0.03, 0, z}, 0), 6, 1e-9);
        EXPECT_TRUE(grid.occupied(grid.index({0.03, d / 2.0 + 0.01, z})));
      }
      EXPECT_NEAR(free_run(grid, {0.03, 0.02, 1}, 2, -1), 1, 1e-9);             // floor at 0
      EXPECT_NEAR(free_run(grid, {0.03, d / 2.0 + 0.1, 3}, 2, -1), 0.5, 1e-9);  // walls 2.5 m high
      EXPECT_GT(free_run(grid, {0.03, 0, 2.5}, 2, 1), 0.9);                     // open above
    }
  }
}

TEST(Scenes, NarrowGapIsOneMetreWideInAThirtyCentimetreWall) {
  for (const double a : {0.05, 0.1}) {
    const auto grid = scene("narrow-gap", a);
    EXPECT_NEAR(free_width(grid, {3.03, 0.03, 1.2}, 1), 1.0, 1e-9);
    EXPECT_NEAR(free_width(grid, {3.03, 0.03, 1.2}, 2), 2.5, 1e-9);
    EXPECT_NEAR(free_width(grid, {3.03, 0.03, 1.2}, 0), 6.0, 1e-9);
    EXPECT_NEAR(free_width(grid, {1.03, 0.03, 1.2}, 1), 4.0, 1e-9);
    EXPECT_NEAR(free_width(grid, {1.03, 1.03, 1.2}, 0) + free_width(grid, {5.03, 1.03, 1.2}, 0), 6.0 - 0.3, 1e-9);
    auto closed = grid;
    block(closed, {2.9, -0.5, 0}, {3.2, 0.5, 2.5});
    EXPECT_FALSE(connected(closed, {1, 0, 1.2}, {5, 0, 1.2}, 0.0));
  }
}

TEST(Scenes, ThinWallIsTenCentimetresThickWithItsOnlyGapFarAside) {
  for (const double a : {0.05, 0.1}) {
    const auto grid = scene("thin-wall", a);
    EXPECT_NEAR(free_width(grid, {2, -1.97, 1.2}, 0) + free_width(grid, {8, -1.97, 1.2}, 0), 10.0 - 0.1, 1e-9);
    EXPECT_NEAR(free_width(grid, {5.03, 3.2, 1.2}, 1), 1.2, 1e-9);
    auto closed = grid;
    block(closed, {5, 2.6, 0}, {5.1, 3.8, 2.5});
    EXPECT_FALSE(connected(closed, {2, -2, 1.2}, {8, -2, 1.2}, 0.0));
  }
}

struct Doorway {
  Vec3 middle;
  int across;  // axis along which its width is measured
};
const std::vector<Doorway> kDoorways = {{{5.93, 2.03, 1.2}, 1}, {{5.93, 6.03, 1.2}, 1}, {{8.03, 4.03, 1.2}, 0}};

TEST(Scenes, ApartmentHasThreeDoorwaysOfTheStatedSize) {
  for (const double a : {0.05, 0.1}) {
    const auto grid = scene("apartment", a);
    for (const auto& door : kDoorways) {
      EXPECT_NEAR(free_width(grid, door.middle, door.across), 1.2, 1e-9);
      EXPECT_NEAR(free_run(grid, {door.middle.x(), door.middle.y(), 1}, 2, 1), 2.1 - 1, 1e-9);
    }
    EXPECT_NEAR(free_width(grid, {3.03, 4.03, 1.2}, 2), 2.6, 1e-9);
    EXPECT_NEAR(free_width(grid, {3, 4.53, 1.2}, 0), 5.8, 1e-9);
  }
}

TEST(Scenes, ApartmentRoomsAreJoinedByNothingButTheirDoorways) {
  auto grid = scene("apartment");
  const Vec3 living(3, 4, 1.2);
  const Vec3 bedroom(7.2, 1.8, 1.2);
  const Vec3 study(7.6, 5.6, 1.2);
  block(grid, {5.8, 1.4, 0}, {6, 2.6, 2.1});
  EXPECT_TRUE(connected(grid, living, bedroom));  // around through the study
  block(grid, {7.4, 3.9, 0}, {8.6, 4.1, 2.1});
  EXPECT_FALSE(connected(grid, living, bedroom, 0.0));
  EXPECT_TRUE(connected(grid, living, study));
  block(grid, {5.8, 5.4, 0}, {6, 6.6, 2.1});
  EXPECT_FALSE(connected(grid, living, study, 0.0));
}

TEST(Scenes, ApartmentRoomsAreFurnished) {
  const auto grid = scene("apartment");
  const auto furniture = [&](const Vec3& low, const Vec3& high) {
    int cells = 0;
    for (std::size_t i = 0; i < grid.cell_count(); ++i) {
      const Vec3 c = grid.center(grid.voxel(i));
      cells += (c.array() > low.array()).all() && (c.array() < high.array()).all() && grid.at(i) == Cell::occupied;
    }
    return cells * 0.001;  // m³
  };
  EXPECT_GT(furniture({0, 0, 0}, {5.8, 8, 2.6}), 1.0);
  EXPECT_GT(furniture({6, 0, 0}, {10, 3.9, 2.6}), 1.0);
  EXPECT_GT(furniture({6, 4.1, 0}, {10, 8, 2.6}), 0.5);
}

TEST(Scenes, ForestIsFixedByItsSeed) {
  const auto equal = [](const OccupancyGrid& a, const OccupancyGrid& b) {
    return std::ranges::equal(a.cells(), b.cells());
  };
  EXPECT_TRUE(equal(scene("forest-7"), scene("forest-7")));
  EXPECT_FALSE(equal(scene("forest-7"), scene("forest-8")));
}

TEST(Scenes, ForestHasAboutTheAreaOfItsPillarsAndFreeEnds) {
  for (const char* name : {"forest-1", "forest-2", "forest-3"}) {
    const auto grid = scene(name);
    EXPECT_EQ(grid.size(), Index3(400, 200, 51));
    int trunks = 0;
    for (int j = 0; j < 200; ++j) {
      for (int i = 0; i < 400; ++i) trunks += grid.occupied(grid.index({-19.95 + 0.1 * i, -9.95 + 0.1 * j, 0.05}));
    }
    EXPECT_LT(trunks * 0.01, 150 * 0.49 + 10);    // rings may touch the floor
    EXPECT_GT(trunks * 0.01, 150 * 0.36 * 0.85);  // some overlap
    const DistanceField distance(grid);
    for (const double x : {-19.0, 19.0}) EXPECT_GT(distance.exact(grid, {x, 0, 2.5}), 0.99);
  }
}

TEST(Scenes, UnknownNamesAndResolutionsAreRefused) {
  for (const std::string name : {"", "flat", "forest", "forest-", "forest-x", "forest--1", "forest-1x",
                                 "forest-18446744073709551616", "parallel-walls-3m", "builtin:apartment"}) {
    const auto grid = builtin_scene(name);
    ASSERT_FALSE(grid) << name;
    EXPECT_EQ(grid.error().kind, MapError::Kind::unknown_name);
    for (const auto& known : builtin_scene_names()) {
      EXPECT_NE(grid.error().message.find(known), std::string::npos) << known;
    }
  }
  for (const double resolution : {0.0, -0.1, 1e-6, 5.0, std::nan("")}) {
    EXPECT_EQ(builtin_scene("apartment", resolution).error().kind, MapError::Kind::bad_resolution);
  }
  EXPECT_EQ(load_map("builtin:nothing").error().kind, MapError::Kind::unknown_name);
  EXPECT_TRUE(load_map("builtin:narrow-gap"));
}

}  // namespace
}  // namespace backwash::map

// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/search/components.hpp"
#include "core/plan/world/world.hpp"

namespace backwash::plan {
namespace {

Vehicle vehicle_5in() { return config::load_vehicle("builtin:quad-5in").value(); }
map::OccupancyGrid corridor() { return map::builtin_scene("parallel-walls-2m", 0.2).value(); }

TEST(World, HasBoundsExactlyWhereTheVehiclesCentreCanBe) {
  const Vehicle vehicle = vehicle_5in();
  const auto world = build_world(corridor(), Model{}, vehicle);
  std::size_t stored = 0;
  for (std::size_t n = 0; n < world->grid.cell_count(); ++n) {
    const Index3 v = world->grid.voxel(n);
    const double least = vehicle.body.radius - 0.2 * std::sqrt(3.0) / 2;
    const bool possible = world->grid.free(v) && world->distance.at(v) >= least;
    ASSERT_EQ(world->bounds.at(v).w[kZ] > 0, possible);
    stored += possible;
    if (!possible) {
      EXPECT_FALSE(world->hover.safe(v));
    }
  }
  EXPECT_GT(stored, 100u);
}

TEST(World, TakesTheFootprintOfTheGroundTermFromTheVehicle) {
  Vehicle vehicle = vehicle_5in();
  vehicle.body.diagonal_radius = 0.5;
  const auto world = build_world(corridor(), Model{}, vehicle);
  EXPECT_NE(Model{}.ground.r0, 0.5);
  Model expected;
  expected.ground.r0 = 0.5;
  const field::ProximityField exact(world->grid, expected);
  for (std::size_t n = 0; n < world->grid.cell_count(); n += 7) {
    const Index3 v = world->grid.voxel(n);
    const double w = world->bounds.at(v).w[kZ];
    if (!(w > 0)) continue;
    const double exactly = bound(exact.at(world->grid.center(v)).sigma(), expected.bound).w[kZ];
    EXPECT_GE(w, exactly * (1 - 1e-6));
    EXPECT_LE(w, exactly * (1 + 1e-6 + reach::kBoundGrowth));
  }
}

TEST(World, DoesNotDependOnHowTheWorkIsDivided) {
  const auto whole = build_world(corridor(), Model{}, vehicle_5in());
  const Parallel backwards_in_parts = [](std::size_t count, const auto& work) {
    for (std::size_t end = count; end > 0;) {
      const std::size_t begin = end > 37 ? end - 37 : 0;
      work(begin, end);
      end = begin;
    }
  };
  const auto parts =
      build_world(corridor(), Model{}, vehicle_5in(), reach::Method::tight, std::nullopt, backwards_in_parts);
  std::size_t safe = 0;
  for (std::size_t n = 0; n < whole->grid.cell_count(); ++n) {
    const Index3 v = whole->grid.voxel(n);
    EXPECT_EQ(whole->bounds.at(v).w, parts->bounds.at(v).w);
    EXPECT_EQ(whole->hover.safe(v), parts->hover.safe(v));
    safe += whole->hover.safe(v);
  }
  EXPECT_GT(safe, 10u);
}

/// A model with a push and a variance by place.
Model extended_model() {
  Model model;
  model.extension = {{Law::push_to_walls, Vec3(0.5, 0, 0), Vec3(0.1, 0, 0), 0.5},
                     {Law::ln_variance_under_surface, Vec3(0.7, 0, 0), Vec3(0.3, 0, 0), 0.8},
                     {Law::push_against_velocity, Vec3(0.3, 0, 0), Vec3(0.05, 0, 0), 0}};
  return model;
}

TEST(World, RestoredIsTheOneThatWasBuilt) {
  const struct {
    Model model;
    reach::Method method;
    std::optional<double> margin;
  } cases[] = {{Model{}, reach::Method::tight, {}},
               {Model{}, reach::Method::paper, {}},
               {Model{}, reach::Method::tight, 0.1},
               {extended_model(), reach::Method::tight, {}}};
  for (const auto& [model, method, margin] : cases) {
    const auto built = build_world(corridor(), model, vehicle_5in(), method, margin);
    const std::string kept = kept_of(*built);
    const auto restore = [&](std::string_view bytes) {
      return rebuilt(unbuilt_world(corridor(), model, vehicle_5in(), method, margin), {.kept = bytes});
    };
    const auto restored = restore(kept);
    ASSERT_TRUE(restored);
    std::size_t safe = 0;
    for (std::size_t n = 0; n < built->grid.cell_count(); ++n) {
      const Index3 v = built->grid.voxel(n);
      ASSERT_EQ(built->bounds.at(v).w, restored->bounds.at(v).w);
      ASSERT_EQ(built->hover.safe(v), restored->hover.safe(v));
      ASSERT_EQ(built->safe.region(v), restored->safe.region(v));
      ASSERT_EQ(built->distance.at(v), restored->distance.at(v));
      const Index3 high = v + Index3(3, 5, 2);
      const Vec3 push(0.1, 0, 0);
      ASSERT_EQ(built->bounds.max_over_voxels(v, high).w, restored->bounds.max_over_voxels(v, high).w);
      ASSERT_EQ(built->bounds.max_about_voxels(push, push, v, high).w,
                restored->bounds.max_about_voxels(push, push, v, high).w);
      ASSERT_EQ(built->safe.passable(v, high), restored->safe.passable(v, high));
      safe += restored->hover.safe(v);
    }
    EXPECT_GT(safe, 10u);
    EXPECT_EQ(restored->constant_margin, margin);
    EXPECT_EQ(restored->reach.loop, built->reach.loop);
    EXPECT_FALSE(restore(std::string_view(kept).substr(1)));
    EXPECT_FALSE(restore(""));
  }
}

TEST(World, UsesThePapersLoopForThePapersMethodOnly) {
  EXPECT_EQ(build_world(corridor(), Model{}, vehicle_5in(), reach::Method::paper)->reach.loop, reach::Loop::continuous);
  EXPECT_EQ(build_world(corridor(), Model{}, vehicle_5in(), reach::Method::tight)->reach.loop, reach::Loop::vehicle);
}

TEST(World, KeepsTheConstantMargin) {
  const auto world = build_world(corridor(), Model{}, vehicle_5in(), reach::Method::tight, 0.1);
  EXPECT_EQ(world->constant_margin, 0.1);
  int safe = 0, unsafe = 0;
  for (std::size_t n = 0; n < world->grid.cell_count(); ++n) {
    const Index3 v = world->grid.voxel(n);
    const auto& vehicle = vehicle_5in();
    const double left = world->distance.at(v) - 0.1 - vehicle.body.radius - vehicle.estimation.position;
    if (std::abs(left) < 1e-6) continue;
    EXPECT_EQ(world->hover.safe(v), left > 0);
    (left > 0 ? safe : unsafe) += 1;
  }
  EXPECT_GT(safe, 10);
  EXPECT_GT(unsafe, 10);
}

TEST(World, WithAnotherClearanceIsTheWorldBuiltForIt) {
  const auto tight = build_world(corridor(), Model{}, vehicle_5in());
  const struct {
    reach::Method method;
    std::optional<double> margin;
  } others[] = {{reach::Method::paper, std::nullopt}, {reach::Method::tight, 0.3}};
  for (const auto& [method, margin] : others) {
    const auto built = build_world(corridor(), Model{}, vehicle_5in(), method, margin);
    const auto changed = rebuilt(*tight, {.clearance = Clearance{sets_of(vehicle_5in(), method), margin}});
    EXPECT_EQ(changed->reach.method, built->reach.method);
    EXPECT_EQ(changed->reach.loop, built->reach.loop);
    EXPECT_EQ(changed->constant_margin, margin);
    std::size_t different = 0;
    for (std::size_t n = 0; n < built->grid.cell_count(); ++n) {
      const Index3 v = built->grid.voxel(n);
      ASSERT_EQ(changed->hover.safe(v), built->hover.safe(v));
      different += changed->hover.safe(v) != tight->hover.safe(v);
    }
    EXPECT_GT(different, 20u);
  }
}

// Walls at any angle: 3,657 normals.
TEST(World, OfABuildingUpdatedByRegionIsTheOneBuiltAnew) {
  const std::string file = BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt";
  const auto before = build_world(*map::load_map(file), Model{}, vehicle_5in());
  std::mt19937 random(3);
  for (int round = 0; round < 2; ++round) {
    map::OccupancyGrid grid = before->grid;
    map::VoxelBox changed;
    Index3 low;
    do {
      low = grid.voxel(random() % grid.cell_count());
    } while (!before->hover.safe(low));
    for (int n = 0; n < 1000; ++n) {  // a crate of which a scan sees parts
      const Index3 v = low + Index3(n % 10, n / 10 % 10, n / 100);
      if (!grid.free(v) || random() % 4 == 0) continue;
      grid.set(v, map::Cell::occupied);
      changed.add(v);
    }
    const auto updated = rebuilt(*before, {.grid = grid, .voxels = changed});
    const auto anew = build_world(grid, Model{}, vehicle_5in());
    std::size_t differ = 0;
    for (std::size_t n = 0; n < grid.cell_count(); ++n) {
      const Index3 v = grid.voxel(n);
      ASSERT_EQ(updated->bounds.at(v).w, anew->bounds.at(v).w) << v.transpose();
      ASSERT_EQ(updated->bounds.max_over_voxels(v, v + Index3(1, 3, 2)).w,
                anew->bounds.max_over_voxels(v, v + Index3(1, 3, 2)).w);
      ASSERT_EQ(updated->hover.safe(v), anew->hover.safe(v)) << v.transpose();
      differ += before->hover.safe(v) != anew->hover.safe(v);
    }
    EXPECT_GT(differ, 300u);
  }
}

// A body that is wider than the field's range: a new obstacle takes hover places where no disturbance changes.
TEST(World, UpdatedByRegionIsTheWorldBuiltAnewForAWideVehicleToo) {
  Vehicle vehicle = vehicle_5in();
  vehicle.body.radius = 1.2;
  Model model;
  model.ground.l_max = model.ground.l_footprint_max = model.corner.l_max = model.wall.l_max = 0.2;
  map::OccupancyGrid grid(Vec3::Zero(), 0.1, Index3(70, 50, 30), map::Cell::free);
  const auto before = build_world(grid, model, vehicle);
  map::VoxelBox changed;
  for (int k = 0; k < 30; ++k) {
    grid.set({20, 25, k}, map::Cell::occupied);
    changed.add({20, 25, k});
  }
  const auto anew = build_world(grid, model, vehicle);
  const auto updated = rebuilt(*before, {.grid = grid, .voxels = changed});
  int far = 0;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Index3 v = grid.voxel(n);
    ASSERT_EQ(updated->hover.safe(v), anew->hover.safe(v)) << v.transpose();
    far += before->hover.safe(v) && !anew->hover.safe(v) && v.x() > 20 + 10;
  }
  EXPECT_GT(far, 10);

  // And what goes gives places back.
  map::OccupancyGrid empty = before->grid;
  const auto back = rebuilt(*anew, {.grid = empty, .voxels = changed});
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Index3 v = grid.voxel(n);
    ASSERT_EQ(back->bounds.at(v).w, before->bounds.at(v).w) << v.transpose();
    ASSERT_EQ(back->hover.safe(v), before->hover.safe(v)) << v.transpose();
  }
}

// What is made first of a large map: its bounds are those of the whole map, and what it calls safe is.
TEST(World, OfAPartSaysWhatTheWholeOneSaysThere) {
  const auto grid = map::builtin_scene("apartment", 0.1).value();
  const auto whole = build_world(grid, Model{}, vehicle_5in());
  const Index3 last = grid.size() - Index3::Ones();
  std::size_t safe = 0, elsewhere = 0;
  for (const Vec3& corner : {Vec3(0, 0, 0), Vec3(1.7, 1.3, 0), Vec3(4, 2.5, 0)}) {
    Index3 low = grid.index(corner).cwiseMax(0), high = (low + Index3(35, 30, 0)).cwiseMin(last);
    low.z() = 0;
    high.z() = last.z();
    const World alone = unbuilt_world(map::part_of(grid, {low, high}), Model{}, vehicle_5in());
    const auto part = rebuilt(alone, {.voxels = map::all_of(alone.grid.size()), .around = &grid});
    for (std::size_t n = 0; n < part->grid.cell_count(); ++n) {
      const Index3 v = part->grid.voxel(n);
      ASSERT_EQ(part->grid.at(v), grid.at(low + v));
      if (part->bounds.at(v).w[kZ] > 0) {
        ASSERT_EQ(part->bounds.at(v).w, whole->bounds.at(low + v).w);
      }
      if (part->hover.safe(v)) {
        ASSERT_TRUE(whole->hover.safe(low + v)) << (low + v).transpose();
        const Vec3 p_W = part->grid.center(v);
        ASSERT_LT((p_W - whole->grid.center(low + v)).norm(), 1e-9);
      }
      safe += part->hover.safe(v);
      elsewhere += whole->hover.safe(low + v) && !part->hover.safe(v);
    }
  }
  EXPECT_GT(safe, 2000u);
  EXPECT_GT(elsewhere, 200u);  // at the part's sides, which count as obstacles
}

// Worlds in which what is unknown below free voxels is taken for a floor (Model::unknown_floor).

using map::Cell;
using map::OccupancyGrid;

const AirFactors kFloorRougher{3, 2, 4, 1, 1};

Vehicle quad_5in() { return config::load_vehicle("builtin:quad-5in").value(); }
Model floor_model() {
  Model model;
  model.unknown_floor = true;
  return model;
}

// Where the lowest layer is free, too: what is below a map is as unknown as what is in it.
TEST(UnknownFloor, BelowTheLowestLayerOfAMapAFloorMayBeAsWell) {
  OccupancyGrid cut(Vec3::Zero(), 0.2, Index3(20, 20, 8), Cell::free);
  OccupancyGrid whole({0, 0, -0.2}, 0.2, Index3(20, 20, 9), Cell::free);
  for (int n = 0; n < 400; ++n) whole.set({n % 20, n / 20, 0}, Cell::unknown);
  for (const bool rougher : {false, true}) {
    const auto made = [&](const OccupancyGrid& grid, const Model& model) {
      auto world = build_world(grid, model, quad_5in());
      return rougher ? rebuilt(*world, {.air = kFloorRougher}) : world;
    };
    const auto of_cut = made(cut, floor_model()), of_whole = made(whole, floor_model()), without = made(cut, Model{});
    for (std::size_t n = 0; n < cut.cell_count(); ++n) {
      const Index3 v = cut.voxel(n), w = v + Index3::UnitZ();
      ASSERT_EQ(of_cut->bounds.at(v).w, of_whole->bounds.at(w).w) << v.transpose();
      if (!rougher) continue;
      ASSERT_EQ(of_cut->air.classes[n], of_whole->air.classes[whole.linear(w)]) << v.transpose();
    }
    const Index3 low(10, 10, 2);
    EXPECT_GT(of_cut->bounds.at(low).w[kZ], 2 * without->bounds.at(low).w[kZ]);
  }
}

// What was learnt over a floor counts over one that is only taken for it: class and bounds are those of a known floor.
TEST(UnknownFloor, InLearntAirIsTheGroundThatAKnownOneIs) {
  OccupancyGrid known(Vec3::Zero(), 0.2, Index3(30, 30, 10), Cell::free), unknown = known;
  for (int n = 0; n < 900; ++n) {
    known.set({n % 30, n / 30, 0}, Cell::occupied);
    unknown.set({n % 30, n / 30, 0}, Cell::unknown);
  }
  const auto learnt = [](const OccupancyGrid& grid) {
    return rebuilt(*build_world(grid, floor_model(), quad_5in()), {.air = AirFactors{1, 2, 1, 1, 1}});
  };
  const auto over_known = learnt(known), over_unknown = learnt(unknown);
  std::size_t ground = 0;
  for (int k = 2; k < 8; ++k) {
    const Index3 v(15, 15, k);
    const AirClass air = over_known->air.classes[known.linear(v)];
    ground += air == AirClass::ground;
    EXPECT_EQ(over_unknown->air.classes[unknown.linear(v)], air) << k;
    EXPECT_EQ(over_unknown->bounds.at(v).w, over_known->bounds.at(v).w) << k;
  }
  EXPECT_GT(ground, 1u);
}

using map::Cell;
using map::OccupancyGrid;

/// Numbers from a flood over shared faces, 0 where a voxel is not free.
std::vector<int> flooded(const OccupancyGrid& grid) {
  std::vector<int> number(grid.cell_count(), 0);
  int last = 0;
  for (std::size_t seed = 0; seed < grid.cell_count(); ++seed) {
    if (number[seed] || grid.at(seed) != Cell::free) continue;
    std::vector<Index3> front{grid.voxel(seed)};
    number[seed] = ++last;
    while (!front.empty()) {
      const Index3 v = front.back();
      front.pop_back();
      for (const Index3& step :
           {Index3(1, 0, 0), Index3(-1, 0, 0), Index3(0, 1, 0), Index3(0, -1, 0), Index3(0, 0, 1), Index3(0, 0, -1)}) {
        const Index3 u = v + step;
        if (!grid.free(u) || number[grid.linear(u)]) continue;
        number[grid.linear(u)] = last;
        front.push_back(u);
      }
    }
  }
  return number;
}

/// Both number the same partition of the free voxels.
void expect_same(const Components& components, const OccupancyGrid& grid) {
  const std::vector<int> number = flooded(grid);
  std::map<int, std::uint32_t> there;
  std::map<std::uint32_t, int> back;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const std::uint32_t component = components.of(grid.voxel(n));
    ASSERT_EQ(component == Components::kNone, number[n] == 0);
    ASSERT_EQ(components.free(grid.voxel(n)), number[n] != 0);
    if (!number[n]) continue;
    ASSERT_EQ(there.emplace(number[n], component).first->second, component) << grid.voxel(n).transpose();
    ASSERT_EQ(back.emplace(component, number[n]).first->second, number[n]) << grid.voxel(n).transpose();
  }
}

/// Walls with few holes: components that wind through many tiles, are joined by one voxel and parted by another.
OccupancyGrid maze(std::mt19937& random, const Index3& size) {
  OccupancyGrid grid({0, 0, 0}, 0.1, size, Cell::free);
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Index3 v = grid.voxel(n);
    const bool wall = v.x() % 7 == 3 || v.y() % 9 == 4 || v.z() % 11 == 5;
    if (wall && random() % 60) grid.set(v, random() % 2 ? Cell::occupied : Cell::unknown);
  }
  return grid;
}

TEST(Components, AreThoseOfAFlood) {
  std::mt19937 random(1);
  for (const Index3& size : {Index3(40, 35, 33), Index3(16, 16, 16), Index3(17, 3, 50), Index3(1, 1, 1)})
    for (int trial = 0; trial < 4; ++trial) {
      const OccupancyGrid grid = maze(random, size);
      expect_same(Components(grid), grid);
    }
}

TEST(Components, FollowWhatJoinsAndPartsThemAndLeaveCopiesAsTheyWere) {
  std::mt19937 random(2);
  OccupancyGrid grid = maze(random, {45, 40, 36});
  Components components(grid);
  for (int round = 0; round < 120; ++round) {
    const OccupancyGrid before = grid;
    const Components old = components;
    map::VoxelBox changed;
    const int apart = round % 2 ? 45 : 3;  // a change far and wide, or in a tile or two
    const Index3 low = grid.voxel(random() % grid.cell_count());
    const auto draw = [&] { return static_cast<int>(random() % static_cast<unsigned>(apart)); };
    for (int n = 0; n < 4; ++n) {
      const Index3 v = (low + Index3(draw(), draw(), draw())).cwiseMin(grid.size() - Index3::Ones());
      grid.set(v, grid.free(v) ? Cell::occupied : Cell::free);
      changed.add(v);
    }
    components.update(grid, changed);
    expect_same(components, grid);
    expect_same(old, before);
  }
}

}  // namespace
}  // namespace backwash::plan

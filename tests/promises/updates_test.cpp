// SPDX-License-Identifier: BSD-3-Clause
// 10⁵ updates of a map (a thousandth in a block): the world that an update makes is the one built anew, bit for bit.
#include <gtest/gtest.h>

#include <map>

#include "tests/promises/flyers.hpp"

namespace backwash::promises {
namespace {

void demand_same(bool same, const std::string& what, const Index3& v) {
  if (!same)
    throw Broken(what + " differs at voxel " + std::to_string(v.x()) + " " + std::to_string(v.y()) + " " +
                 std::to_string(v.z()));
}

/// Maxima, regions and passages over boxes of up to so many voxels.
void demand_same_boxes(const plan::World& a, const plan::World& b, Random& random) {
  const Index3 size = a.grid.size();
  for (int n = 0; n < 200; ++n) {
    Index3 low, high;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = random.whole(0, size[axis] - 1);
      high[axis] = low[axis] + random.whole(0, 12);
    }
    demand_same(a.bounds.max_over_voxels(low, high).w == b.bounds.max_over_voxels(low, high).w, "max over a box", low);
    const Vec3 push = random.within(Vec3::Constant(-0.3), Vec3::Constant(0.3)), v = 3 * push;
    demand_same(a.bounds.max_about_voxels(push, v, low, high).w == b.bounds.max_about_voxels(push, v, low, high).w,
                "max about a push", low);
    demand_same(a.safe.passable(low, high) == b.safe.passable(low, high), "passage", low);
    demand_same(a.sums.voxels_free(low, high) == b.sums.voxels_free(low, high), "box count", low);
  }
}

void demand_same_worlds(const plan::World& a, const plan::World& b, Random& random) {
  std::map<std::uint32_t, std::uint32_t> regions, back;  // numbers may differ, what they join may not
  for (std::size_t n = 0; n < a.grid.cell_count(); ++n) {
    const Index3 v = a.grid.voxel(n);
    demand_same(a.grid.at(n) == b.grid.at(n), "cell", v);
    demand_same(a.distance.at(v) == b.distance.at(v), "distance", v);
    demand_same(a.bounds.codes(v) == b.bounds.codes(v), "bound", v);
    demand_same(a.hover.safe(v) == b.hover.safe(v), "hover map", v);
    const auto of_a = a.safe.region(v), of_b = b.safe.region(v);
    demand_same(regions.try_emplace(of_a, of_b).first->second == of_b, "region", v);
    demand_same(back.try_emplace(of_b, of_a).first->second == of_a, "region", v);
    if (!a.air.known() || !a.air.sigma->has(v)) continue;
    demand_same(a.air.classes[n] == b.air.classes[n], "class", v);
    demand_same(a.air.flown_at(n).xx == b.air.flown_at(n).xx && a.air.flown_at(n).zz == b.air.flown_at(n).zz, "Σ", v);
  }
  demand_same(a.bounds.largest().w == b.bounds.largest().w, "largest bound", Index3::Zero());
  demand_same_boxes(a, b, random);
}

TEST(Promises, AnUpdatedWorldIsTheOneBuiltAnew) {
  constexpr unsigned kWorlds = 20, kUpdates = 5;
  std::size_t places = 0;
  draw_all(4, kWorlds, [&](Random& random) {
    const bool window = random.chance(0.3), extended = random.chance(0.2);
    DrawnModel air = draw_model(random, true);
    air.model.unknown_floor = window;
    if (extended) {
      air.factors = kModelledAir;
      air.model.extension = {{Law::push_to_walls, Vec3(0.5, 0, 0), Vec3(0.1, 0, 0), random.uniform(0.2, 1)},
                             {Law::ln_variance_under_surface, Vec3(0.7, 0, 0), Vec3(0.3, 0, 0), random.uniform(0.2, 1)},
                             {Law::push_against_velocity, Vec3(0.3, 0, 0), Vec3(0.05, 0, 0), 0}};
    }
    const Vehicle vehicle = draw_flyer(random, random.chance(0.2)).vehicle;
    const auto method =
        random.chance(0.1) && !reach::has_integrator(vehicle) ? reach::Method::paper : reach::Method::tight;
    const auto margin = random.chance(0.1) ? std::optional(random.uniform(0, 0.3)) : std::nullopt;
    const auto anew = [&](const map::OccupancyGrid& grid) {
      const auto world = plan::build_world(grid, air.model, vehicle, method, margin);
      return air.factors == kModelledAir ? world : plan::rebuilt(*world, {.air = air.factors});
    };
    map::OccupancyGrid grid = draw_map(random, {1, 1, 1}, {50, 36, 24}, window);
    try {
      auto world = anew(grid);
      for (unsigned n = 0; n < kUpdates; ++n) {
        const auto cell = static_cast<map::Cell>(random.whole(0, 2));
        map::VoxelBox changed = draw_box(random, grid, cell, random.whole(1, 12));
        for (int speck = random.whole(0, 3); speck > 0; --speck) {
          const Index3 v =
              grid.voxel(static_cast<std::size_t>(random.whole(0, static_cast<int>(grid.cell_count()) - 1)));
          if (changed.empty() || (v - changed.low).cwiseAbs().maxCoeff() < 20) {
            grid.set(v, static_cast<map::Cell>(random.whole(0, 2)));
            changed.add(v);
          }
        }
        world = plan::rebuilt(*world, {.grid = grid, .voxels = changed});
        demand_same_worlds(*world, *anew(grid), random);
        places += safe_places(*world).size();
      }
    } catch (const std::invalid_argument&) {  // a loop that settles too late
    }
  });
  EXPECT_GT(places, 1000u);
}

}  // namespace
}  // namespace backwash::promises

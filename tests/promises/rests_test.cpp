// SPDX-License-Identifier: BSD-3-Clause
// 10⁶ places of rest (a thousandth in a block): hovers, and stops along plans. What the worst disturbance makes of the
// error in 30 s at rest, by answers of our own, stays clear by an independent distance.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/plan/planner.hpp"
#include "core/plan/search/ends.hpp"
#include "core/plan/verified_stops.hpp"
#include "core/reach/clearance.hpp"
#include "tests/promises/flyers.hpp"
#include "tests/promises/separation.hpp"

namespace backwash::promises {
namespace {

constexpr double kWithin = 1 + 1e-5, kExact = 1e-6;  // m
constexpr double kUntold = 0.02;                     // m: that a hover's clearance may be too small; seen: 0.0126
constexpr double kAlike = 1e-5;                      // of a set; a set just larger may meet one voxel more
constexpr int kRest = 1500, kStride = 5;             // periods

/// A world and what its vehicle answers, by period: own shares of the worst case, as docs/model.md 5.2-1 defines them.
class Place {
 public:
  explicit Place(const FlyersWorld& flyers)
      : world(flyers.world), obstacles(world->grid), net_(world->reach, world->bounds) {
    const auto& first = world->reach.vehicle.initial_error;
    for (const bool vertical : {false, true}) {
      const Plant plant = flyers.vehicle.plant(vertical, false);
      const Answer answer(plant, (kRest + 600) * plant.per_period);
      const auto at = [&](int n) { return static_cast<std::size_t>(n); };
      for (int j = 0; j < kRest + 600; ++j) {
        double share = 0;
        for (int n = j * plant.per_period + 1; n <= (j + 1) * plant.per_period; ++n)
          share += std::abs(answer.push[0][at(n)]);
        share_[vertical].push_back(share);
        total_[vertical] += share;
        first_[vertical].push_back(std::hypot(first.position * answer.from_position[at(j * plant.per_period)],
                                              first.velocity * answer.from_velocity[at(j * plant.per_period)]));
      }
      auto& shares = share_[vertical];  // what is left of them is nothing
      while (shares.size() > 1 && shares.back() < 1e-12 * total_[vertical]) shares.pop_back();
    }
  }

  /// w̄ over the voxels that meet c ± h, each looked at; less what an integrator holds.
  PerDirection bound(const Vec3& c, const PerDirection& h) const {
    const map::OccupancyGrid& grid = world->grid;
    const Vec3 half(h[kX], h[kY], h[kZ]);
    const Index3 low = grid.index(c - half).cwiseMax(0);
    const Index3 high = grid.index(c + half).cwiseMin(grid.size() - Index3::Ones());
    DisturbanceBound most;
    map::for_each_voxel({low, high}, [&](const Index3& v) {
      const auto w = world->bounds.at(v).w;
      for (std::size_t d = 0; d < kDirections; ++d) most.w[d] = std::max(most.w[d], w[d]);
    });
    return net_(most).w;
  }
  /// What the worst disturbance of bounds w makes of the error after all of them.
  PerDirection reached(const std::vector<PerDirection>& w) const {
    PerDirection h;
    for (std::size_t d = 0; d < kDirections; ++d) {
      const auto& share = share_[d == kZ];
      h[d] = first_[d == kZ][std::min(w.size(), first_[d == kZ].size() - 1)];
      for (std::size_t age = 0; age < std::min(w.size(), share.size()); ++age)
        h[d] += w[w.size() - 1 - age][d] * share[age];
    }
    return h;
  }
  /// The error of a hover that has always been one, with shares larger by `more`; nothing where it grows for ever.
  std::optional<PerDirection> hover(const Vec3& c, double more = 0) const {
    PerDirection h{};
    for (int round = 0; round < 200; ++round) {
      const PerDirection w = bound(c, h), before = h;
      for (std::size_t d = 0; d < kDirections; ++d) h[d] = (1 + more) * w[d] * total_[d == kZ];
      if (h == before) return h;
    }
    return std::nullopt;
  }
  double clearance(const Vec3& c, const PerDirection& h, double cap) const {
    const Vehicle& v = world->reach.vehicle;
    const double taken = v.body.radius + v.estimation.position;
    return obstacles.distance(prism_corners(c, h), cap + taken) - taken;
  }

  std::shared_ptr<const plan::World> world;
  Obstacles obstacles;

 private:
  reach::NetDisturbance net_;
  std::array<std::vector<double>, 2> share_, first_;
  std::array<double, 2> total_{};
};

/// A hover anywhere: as clear as is said, and where it may rest clear indeed.
void demand_hover(const Place& place, const Vec3& p) {
  const auto h = place.hover(p);
  const double cap = reach::kHoverClearanceCap, clear = h ? place.clearance(p, *h, cap) : 0;
  const std::string at = " at " + std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z());
  if (plan::may_rest_at(*place.world, p, 0)) demand_at_most(-clear, kExact, "rests where it is not clear" + at);
  const auto& w = *place.world;
  const auto set = reach::hover_set(w.reach, w.grid, w.distance, w.bounds, p);
  const auto smaller = place.hover(p, -kAlike), larger = place.hover(p, kAlike);
  if (!smaller || !larger || !set.bounded || !(clear > 0)) return;
  demand_at_most(set.clearance, place.clearance(p, *smaller, cap) + kExact, "clearance of a hover" + at);
  demand_at_most(place.clearance(p, *larger, cap), set.clearance + kUntold, "clearance of a hover not told" + at);
}

/// A stop: from its last command on the error stays in the set that is to hold for ever, and that set is clear.
void demand_stop(const Place& place, const plan::Plan& plan, const State& start, const plan::Stop& stop) {
  const auto& world = *place.world;
  std::vector<Setpoint> commands(plan.commands.begin(),
                                 plan.commands.begin() + static_cast<std::ptrdiff_t>(stop.branch));
  commands.insert(commands.end(), stop.commands.begin(), stop.commands.end());
  const std::size_t moving = commands.size();
  commands.insert(commands.end(), kRest, Setpoint{commands.back().p_W});
  const auto tube = reach::tube_over_field(world.reach, start, plan.commands.front(), commands, world.bounds);
  std::vector<PerDirection> w;
  for (std::size_t k = 0; k < moving; ++k) w.push_back(tube[k].w_bar.w);
  PerDirection checked{};
  const PerDirection& for_ever = stop.tube.back().half_widths;
  for (std::size_t k = moving; k + kStride < commands.size(); k += kStride) {
    const PerDirection h = place.reached(w);
    const Vec3& c = tube[k].center.p_W;
    for (std::size_t d = 0; d < kDirections; ++d) {
      const double off = std::abs(unit(static_cast<Direction>(d)).dot(c - stop.tube.back().center.p_W));
      demand_at_most(h[d] + off, for_ever[d] * kWithin + kExact,
                     "at rest since " + std::to_string(k - moving) + " periods, direction " + std::to_string(d));
    }
    const auto grown = [&](std::size_t d) { return h[d] > checked[d] + 1e-4; };
    if (k == moving || grown(kX) || grown(kY) || grown(kZ) || grown(kXyPlus) || grown(kXyMinus)) {
      demand_at_most(-place.clearance(c, h, 0.1), kExact, "a stop rests where it is not clear");
      for (std::size_t d = 0; d < kDirections; ++d) checked[d] = std::max(checked[d], h[d]);
    }
    w.insert(w.end(), kStride, place.bound(c, h));
  }
}

TEST(Promises, WhereItMayRestTheWorstErrorOfHalfAMinuteIsClear) {
  constexpr unsigned kWorlds = 10, kHovers = 50, kStops = 50, kTries = 60;
  unsigned stops = 0;
  draw_all(2, kWorlds, [&](Random& random) {
    const Place place(draw_flyers_world(random, {20, 20, 10}, {34, 34, 16}));
    const auto& world = *place.world;
    const auto places = safe_places(world);
    for (unsigned n = 0; n < kHovers; ++n)  // beside safe places, too
      demand_hover(place, draw_place(random, world, places) + random.within(Vec3::Constant(-0.3), Vec3::Constant(0.3)));
    const auto& limits = world.reach.vehicle.limits;
    for (unsigned tries = 0, found = 0; tries < kTries && found < kStops; ++tries) {
      const plan::PlanOptions options{.v_max = std::min(limits.v_max, 3.0), .a_max = std::min(limits.a_max, 4.0)};
      const Vec3 from = draw_place(random, world, places), goal = draw_place(random, world, places);
      const State start{from, Vec3::Zero()};
      const auto plan = plan::plan(world, {start, {from}}, goal, options);
      if (plan.status != plan::PlanStatus::ok) continue;
      const auto clear = [&](const reach::ReachTube& tube) { return plan::tube_clearance(world, tube); };
      for (const auto& stop : plan::verified_stops(world, start, plan.commands.front(), plan.commands, 0,
                                                   plan.commands.size() / 8 + 1, clear))
        if (found < kStops) {
          demand_stop(place, plan, start, stop);
          ++found;
          ++stops;
        }
    }
  });
  EXPECT_EQ(stops, kWorlds * kStops);
}

}  // namespace
}  // namespace backwash::promises

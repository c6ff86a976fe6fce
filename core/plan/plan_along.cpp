// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/plan_along.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "core/plan/search/way.hpp"
#include "core/reach/clearance.hpp"

namespace backwash::plan {
namespace {

constexpr double kFirst = 10;      ///< voxels about the way that are made first
constexpr double kMuch = 1.0 / 3;  ///< share of the places from which on the whole world costs little more
constexpr double kLonger = 1.1;    ///< length of a plan over that of the way, with which a better one is not looked for

/// What is known of a map: where a vehicle may be, and how far from the ways looked at.
class Known {
 public:
  Known(const map::OccupancyGrid& map, const Vehicle& vehicle, const PlanStart& start, const Vec3& goal_W)
      : map_(map),
        distance_(map),
        ends_{start.command.p_W, goal_W},
        hops_(map.cell_count(), kNever),
        space_(places(vehicle)) {
    by_ = Index3::Constant(static_cast<int>(std::ceil(vehicle.body.radius / map.resolution())) + 2);
    for (const Vec3& end : ends_) seed(end);
  }

  /// Length of the way over what is safe or not made yet, m; infinite if there is none. A new way is made along, too.
  double take_way() {
    const SafeView view(space_, {map_.index(ends_[0]), map_.index(ends_[1])});
    if (!view.passable(map_.index(ends_[0])) || !view.passable(map_.index(ends_[1]))) return kNone;
    std::array<Way, 3> ways;
    double shortest = kNone;
    for (std::size_t n = 0; n < ways.size(); ++n) {
      ways[n] = way_over_blocks(view, ends_[0], ends_[1], 4 >> n, std::numeric_limits<std::size_t>::max(),
                                std::chrono::steady_clock::time_point::max());
      shortest = std::min(shortest, length_of(ways[n]));
    }
    // Wide places are more often safe.
    for (const Way& way : ways)
      if (const double length = length_of(way); length < kNone && length <= kLonger * shortest) {
        take(pulled(view, way.points));
        return length;
      }
    return kNone;
  }

  /// What a vehicle reaches within so many metres of the ways is to be made; its share of all places, 1 if there is no
  /// more to reach.
  double reach(double metres) {
    std::size_t places = 0, made = 0;
    for (std::uint16_t& hops : hops_)
      if (hops != kNever) {
        hops = kUnreached;
        ++places;
      }
    box_ = {};
    std::vector<Index3> front, next;
    for (const std::size_t n : seeds_) meet(map_.voxel(n), 0, next);
    made += next.size();
    const int most = static_cast<int>(metres / map_.resolution());
    for (int hops = 1; hops <= most && !next.empty(); ++hops) {
      front.swap(next);
      next.clear();
      for (const Index3& v : front)
        map::for_each_voxel({v - Index3::Ones(), v + Index3::Ones()}, [&](const Index3& u) {
          if (map_.inside(u)) meet(u, static_cast<std::uint16_t>(hops), next);
        });
      made += next.size();
    }
    return next.empty() ? 1 : static_cast<double>(made) / static_cast<double>(places);
  }

  /// The map of that.
  map::OccupancyGrid part() {
    const Index3 last = map_.size() - Index3::Ones();
    for (const Vec3& end : ends_) box_.add(map_.index(end).cwiseMax(0).cwiseMin(last));
    box_ = {(box_.low - by_).cwiseMax(0), (box_.high + by_).cwiseMin(last)};
    map::OccupancyGrid part = map::part_of(map_, box_);
    map::for_each_voxel(box_, [&](const Index3& v) {
      if (hops_[map_.linear(v)] == kUnreached) part.set(v - box_.low, map::Cell::unknown);
    });
    return part;
  }

  /// Takes over where a world of part(), made within so many metres, found hovering unsafe. Places whose set may reach
  /// what was not made are left out.
  void learn(const World& world, double metres) {
    const reach::Reachability& reach = world.reach;
    const double set = world.constant_margin.value_or(std::ranges::max(world.bounds.largest().w) *
                                                      std::max(reach.horizontal.h_inf, reach.vertical.h_inf));
    const double inside = (metres - set - reach::body_and_estimation(reach.vehicle)) / map_.resolution() - 2;
    map::VoxelBox changed;
    map::for_each_voxel(box_, [&](const Index3& v) {
      if (hops_[map_.linear(v)] > inside || !places_.free(v) || world.hover.safe(v - box_.low)) return;
      places_.set(v, map::Cell::unknown);
      changed.add(v);
    });
    if (!changed.empty()) space_.update(places_, changed);
  }

  /// A plan as the whole map measures it: what was not made is no obstacle there. `apart`: as in risk_of(), m.
  Plan measured(const World& world, Plan plan, double apart) const {
    if (plan.status != PlanStatus::ok) return plan;
    World whole = world;  // its obstacles: of the rest nothing is read
    whole.grid = map_;
    whole.distance = distance_;
    plan.metrics.min_clearance_m = nearest_approach(whole, plan.tube).clearance;
    plan.metrics.risk = risk_of(whole, plan.tube, 0, apart);
    return plan;
  }

  static constexpr double kNone = std::numeric_limits<double>::infinity();

 private:
  static constexpr std::uint16_t kNever = 0xffff, kUnreached = 0xfffe;

  /// Fills hops_ and places_: a hover-safe place is farther from obstacles than body and estimation reach.
  const map::OccupancyGrid& places(const Vehicle& vehicle) {
    const double taken = reach::body_and_estimation(vehicle);
    for (const std::size_t n : voxels_for_centre(map_, distance_, vehicle, map::all_of(map_.size()))) {
      hops_[n] = kUnreached;
      const Index3 v = map_.voxel(n);
      if (distance_.at(v) > taken) places_.set(v, map::Cell::free);
    }
    return places_;
  }
  static double length_of(const Way& way) {
    double length = way.status == Way::Status::found ? 0 : kNone;
    for (std::size_t n = 1; n < way.points.size(); ++n) length += (way.points[n] - way.points[n - 1]).norm();
    return length;
  }
  /// The way without the points that a straight line passes by.
  static std::vector<Vec3> pulled(const SafeView& view, const std::vector<Vec3>& way) {
    const auto clear = [&](const Vec3& from, const Vec3& to) {
      const Vec3 step = to - from;
      const int parts = static_cast<int>(2 * step.norm() / view.space().resolution()) + 1;
      for (int part = 0; part <= parts; ++part)
        if (!view.passable(view.space().index(from + step * part / parts))) return false;
      return true;
    };
    std::vector<Vec3> points{way.front()};
    for (std::size_t n = 1; n < way.size(); ++n) {
      std::size_t last = way.size() - 1;
      while (last > n && !clear(points.back(), way[last])) --last;
      n = last;
      points.push_back(way[n]);
    }
    return points;
  }
  void take(const std::vector<Vec3>& way) {
    for (std::size_t n = 1; n < way.size(); ++n) {
      const Vec3 &from = way[n - 1], step = way[n] - from;
      const int parts = static_cast<int>(2 * step.norm() / map_.resolution()) + 1;
      for (int part = 0; part <= parts; ++part) seed(from + step * part / parts);
    }
  }
  void seed(const Vec3& p_W) {
    const Index3 v = map_.index(p_W);
    if (map_.inside(v) && hops_[map_.linear(v)] != kNever) seeds_.push_back(map_.linear(v));
  }
  void meet(const Index3& v, std::uint16_t hops, std::vector<Index3>& met) {
    std::uint16_t& here = hops_[map_.linear(v)];
    if (here != kUnreached) return;
    here = hops;
    box_.add(v);
    met.push_back(v);
  }

  const map::OccupancyGrid& map_;
  map::DistanceField distance_;
  std::array<Vec3, 2> ends_;
  Index3 by_ = Index3::Zero();       // voxels beyond a place that its distance to obstacles may ask for
  std::vector<std::uint16_t> hops_;  // from the ways, king's moves through places for the centre; kNever: it is none
  map::OccupancyGrid places_{map_.origin(), map_.resolution(), map_.size()};  // free: safe, or not made yet
  SafeSpace space_;                                                           // of them
  std::vector<std::size_t> seeds_;
  map::VoxelBox box_;
};

}  // namespace

Plan plan_along(const map::OccupancyGrid& map, const Model& model, const Vehicle& vehicle, const MakeWorld& make,
                const PlanStart& start, const Vec3& goal_W, const PlanOptions& options) {
  if (!model.extension.empty() || reach::has_integrator(vehicle))
    return plan(*make(map, nullptr), start, goal_W, options);
  Known known(map, vehicle, start, goal_W);
  double way = known.take_way();
  std::optional<Plan> longer;
  for (double metres = kFirst * map.resolution();; metres *= 4) {
    if (known.reach(metres) > kMuch && way < Known::kNone) {
      Plan found = plan(*make(map, nullptr), start, goal_W, options);
      return found.status == PlanStatus::ok || !longer ? found : *std::move(longer);
    }
    const auto world = make(known.part(), &map);
    Plan found = plan(*world, start, goal_W, options);
    found = known.measured(*world, std::move(found), options.least_clearance_m);
    if (way == Known::kNone) return found;
    known.learn(*world, metres);
    way = known.take_way();
    if (way == Known::kNone || (found.status == PlanStatus::ok && found.metrics.length_m <= kLonger * way))
      return found;
    if (found.status == PlanStatus::ok) longer = std::move(found);
  }
}

}  // namespace backwash::plan

// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/design/ways.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/plan/search/ends.hpp"
#include "core/study/design/design_rules.hpp"
#include "core/types/angle.hpp"

namespace backwash::study {
namespace {

using Points = std::vector<Vec3>;

/// Voxels that are joined to the start by others at which hovering is safe, and what a way needs to know of them.
class Room {
 public:
  Room(const plan::World& world, const Vec3& start_W)
      : world_(world), region_(world.safe.region(world.grid.index(start_W))) {
    double most = -1;
    for (std::size_t n = 0; n < world.grid.cell_count(); ++n) {
      const Index3 v = world.grid.voxel(n);
      if (!holds(v)) continue;
      voxels_.push_back(v);
      const double way = (world.grid.center(v) - start_W).norm();
      const double room = world.distance.at(v) - kDesignRules.design_nearer * way;  // the nearest of the roomiest
      if (room > most) {
        most = room;
        open_ = v;
      }
    }
  }
  bool empty() const { return voxels_.empty(); }
  Vec3 at(const Index3& v) const { return world_.grid.center(v); }
  Vec3 open() const { return at(open_); }

  /// The last place in a straight line of steps from the open spot.
  Vec3 end(const Index3& step) const {
    Index3 v = open_;
    while (holds(v + step)) v += step;
    return at(v);
  }
  /// Metres from a voxel's centre to the solid face in the direction of a step; nothing within the map: none.
  std::optional<double> to_solid(Index3 v, const Index3& step) const {
    for (int n = 0; world_.grid.inside(v); v += step, ++n)
      if (world_.grid.occupied(v)) return (n - 0.5) * world_.grid.resolution();
    return std::nullopt;
  }
  Index3 open_voxel() const { return open_; }
  /// The safe place with the nearest solid above it, and the one with the farthest at the same height.
  std::optional<std::pair<Vec3, Vec3>> under_and_beside() const {
    std::optional<std::pair<double, Index3>> under, beside;
    for (const Index3& v : voxels_)
      if (const auto gap = to_solid(v, up()); gap && (!under || *gap < under->first)) under = {*gap, v};
    if (!under) return std::nullopt;
    for (const Index3& v : voxels_) {
      if (v.z() != under->second.z()) continue;
      const double gap = to_solid(v, up()).value_or(INFINITY);
      if (!beside || gap > beside->first) beside = {gap, v};
    }
    return std::pair(at(under->second), at(beside->second));
  }
  static Index3 up() { return {0, 0, 1}; }

 private:
  bool holds(const Index3& v) const { return region_ != plan::Components::kNone && world_.safe.region(v) == region_; }
  const plan::World& world_;
  std::uint32_t region_;
  std::vector<Index3> voxels_;
  Index3 open_ = Index3::Zero();
};

/// The corners of a level polygon about a point.
Points ring(const Vec3& centre, double side, int corners) {
  Points points;
  const double radius = side / 2 / std::sin(std::numbers::pi / corners);
  for (int k = 0; k < corners; ++k) {
    const double angle = 2 * std::numbers::pi * (k + 0.5) / corners;
    points.push_back(centre + radius * Vec3(std::cos(angle), std::sin(angle), 0));
  }
  return points;
}

/// There and back in steps of about so much.
Points steps(const Vec3& from, const Vec3& to, double length) {
  const int n = std::max(1, static_cast<int>(std::lround((to - from).norm() / length)));
  Points points;
  for (int k = 0; k <= n; ++k) points.push_back(from + k * (to - from) / n);
  for (int k = n - 1; k > 0; --k) points.push_back(from + k * (to - from) / n);
  return points;
}

std::string metres(double x) {
  char text[16];
  std::snprintf(text, sizeof text, "%.2g m", x);
  return text;
}

class List {
 public:
  explicit List(const Room& room) : room_(room), open_(room.open()) {}
  std::vector<Way> all() {
    stand();
    heights();
    lines();
    turns();
    ceilings();
    walls();
    return std::move(ways_);
  }

 private:
  void add(std::string name, const Points& points) {
    std::vector<Waypoint> way;
    for (const Vec3& p : points) way.push_back({p, {}});
    ways_.push_back({std::move(name), std::move(way), {}});
  }
  void cannot(std::string name, std::string why) { ways_.push_back({std::move(name), {}, std::move(why)}); }
  Vec3 low() const { return room_.end({0, 0, -1}); }
  Vec3 high() const { return room_.end({0, 0, 1}); }

  void stand() {
    add("stand still at an open spot", {open_});
    add("stand still low", {low()});
    add("stand still high", {high()});
  }
  void heights() {
    const Vec3 middle = 0.5 * (low() + high());
    add("hover low, in the middle and high", {low(), low(), middle, middle, high(), high()});
    add("hover at many heights", steps(low(), high(), kDesignRules.design_slow_step / 2));
    add("up and down, the whole height", {low(), high()});
    add("up and down, about a low height", {low(), low() + Vec3(0, 0, kDesignRules.design_small_side)});
    const auto floor = room_.to_solid(room_.open_voxel(), {0, 0, -1});
    if (!floor) return cannot("hover 0.3, 0.8 and 1.3 m over the floor", "the map shows no floor there");
    Points points;
    for (const double height : {0.3, 0.8, 1.3}) points.insert(points.end(), 2, open_ + Vec3(0, 0, height - *floor));
    add("hover 0.3, 0.8 and 1.3 m over the floor", points);
  }
  void lines() {
    for (const auto& [name, step] : {std::pair{"x", Index3(1, 0, 0)}, {"y", Index3(0, 1, 0)}}) {
      const Vec3 from = room_.end(-step), to = room_.end(step);
      add(std::string("side to side along ") + name + ", fast", {from, to});
      add(std::string("side to side along ") + name + ", slowly", steps(from, to, kDesignRules.design_slow_step));
    }
    add("corner to corner",
        {room_.end({-1, -1, 0}), room_.end({1, 1, 0}), room_.end({-1, 1, 0}), room_.end({1, -1, 0})});
  }
  void turns() {
    for (const double side : {kDesignRules.design_small_side.value, kDesignRules.design_large_side.value})
      for (const auto& [name, corners] : {std::pair{"a triangle", 3}, {"a square", 4}, {"an octagon", 8}})
        add(std::string("turn the heading on ") + name + ", sides of " + metres(side), ring(open_, side, corners));
    const Vec3 half(kDesignRules.design_large_side, 0, 0);  // long enough a way to turn by π on
    add("turn the heading to and fro on " + metres(2 * kDesignRules.design_large_side), {open_ - half, open_ + half});
    Points squares = ring(low(), kDesignRules.design_small_side, 4),
           upper = ring(high(), kDesignRules.design_small_side, 4);
    squares.insert(squares.end(), upper.begin(), upper.end());
    add("turn the heading on squares, low and high", squares);
    turns_on_the_spot();
  }
  /// Each place with all headings, or with one of them in turn.
  void turns_on_the_spot() {
    const std::string name = "turn the heading on the spot, ";
    for (const auto& [step, parts] : {std::pair{"by a quarter", 4}, {"by a third", 3}, {"to and fro", 2}})
      ways_.push_back({name + step, headings({open_}, parts), {}});
    ways_.push_back({name + "by a quarter, low and high", headings({low(), high()}, 4), {}});
    ways_.push_back({name + "to and fro, low and high", headings({low(), high()}, 2), {}});
  }
  /// The parts of a whole turn, at each of the places in turn. The start's own heading is the last one.
  static std::vector<Waypoint> headings(const Points& places, int parts) {
    std::vector<Waypoint> points;
    for (int k = 1; k <= parts; ++k)
      for (const Vec3& p : places) points.push_back({p, wrap_angle(2 * std::numbers::pi * k / parts)});
    return points;
  }
  void ceilings() {
    const std::string name = "hover 0.25, 0.5 and 1 m below the ceiling";
    if (const auto gap = room_.to_solid(room_.open_voxel(), Room::up())) {
      Points points;
      for (const double below : {0.25, 0.5, 1.0}) points.insert(points.end(), 2, open_ + Vec3(0, 0, *gap - below));
      add(name, points);
    } else {
      cannot(name, "the map shows no ceiling there");
    }
    const auto both = room_.under_and_beside();
    if (!both) return cannot("a spot without ceiling, then the same height under one", "the map shows no ceiling");
    add("a spot without ceiling, then the same height under one",
        {both->second, both->second, both->first, both->first});
  }
  void walls() {
    for (const auto& [name, step] : {std::pair{"x", Index3(1, 0, 0)}, {"y", Index3(0, 1, 0)}}) {
      const std::string of = std::string("approach the walls along ") + name;
      const Vec3 from = room_.end(-step), to = room_.end(step);
      add(of + ", as near as is safe", {open_, to, to, open_, from, from});
      const auto a = room_.to_solid(room_.open_voxel(), -step), b = room_.to_solid(room_.open_voxel(), step);
      const std::string near = of + " to " + metres(kDesignRules.design_wall_distance);
      if (!a || !b) {
        cannot(near, "the map shows no wall there");
        continue;
      }
      const Vec3 along = step.cast<double>();
      const Vec3 left = open_ - (*a - kDesignRules.design_wall_distance) * along,
                 right = open_ + (*b - kDesignRules.design_wall_distance) * along;
      add(near, {open_, right, right, open_, left, left});
    }
  }

  const Room& room_;
  Vec3 open_;
  std::vector<Way> ways_;
};

}  // namespace

std::vector<Way> ways(const plan::World& world, const Vec3& start_W) {
  const Room room(world, start_W);
  if (room.empty()) return {};
  return List(room).all();
}

FlownWay flown_way(const plan::World& world, const Vec3& start_W, const Way& way, double flight_time) {
  const auto refused = [](std::string why) { return FlownWay{{}, {}, std::move(why)}; };
  if (way.points.empty()) return refused(way.why_not);
  for (const Waypoint& p : way.points)
    if (const auto why = plan::why_no_rest(world, p.p_W, 0)) return refused(*why);
  const auto& limits = world.reach.vehicle.limits;
  const plan::PlanOptions options{
      .v_max = limits.v_max, .a_max = limits.a_max, .deadline_s = kDesignRules.design_plan_deadline};
  const auto most = static_cast<std::size_t>(flight_time / kControlPeriod);
  const std::size_t around = way.points.size();
  const bool facing = std::ranges::any_of(way.points, [](const Waypoint& p) { return p.yaw.has_value(); });
  const double most_rows = facing ? kDesignRules.design_most_facing : kDesignRules.design_most_rows;
  std::vector<std::vector<Setpoint>> legs(around);  // to each point, from the one before it
  FlownWay flown;
  Setpoint now;
  now.p_W = start_W;
  for (std::size_t k = 0; flown.points.size() < static_cast<std::size_t>(most_rows); ++k) {
    const Waypoint& goal = way.points[k % around];
    auto commands = k > 0 ? legs[k % around] : std::vector<Setpoint>();
    if (commands.empty()) {
      auto leg = plan::plan(world, {{now.p_W, Vec3::Zero()}, now}, goal.p_W, options);
      if (leg.status != plan::PlanStatus::ok) return refused(leg.message);
      commands = std::move(leg.commands);
      if (k > 0) legs[k % around] = commands;
    }
    commands = plan::facing_ahead(std::move(commands), {now.yaw, 0}, options.yaw);
    if (goal.yaw) {
      const auto turn = plan::turned_to(commands.back(), *goal.yaw, options.yaw);
      commands.insert(commands.end(), turn.begin(), turn.end());
    }
    flown.commands.insert(flown.commands.end(), commands.begin(), commands.end());
    now.p_W = goal.p_W;
    now.yaw = commands.back().yaw;
    flown.points.push_back(goal);
    if (flown.commands.size() >= most) break;
  }
  return flown;
}

}  // namespace backwash::study

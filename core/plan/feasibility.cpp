// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/feasibility.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <queue>
#include <tuple>

#include "core/reach/clearance.hpp"

namespace backwash::plan {
namespace {

constexpr double kClearanceCap = 1.0;  // m, as hover_set's

/// Clearance of the hover set at a voxel's centre, m.
double clearance(const World& world, const Index3& v) {
  const Vec3 p_W = world.grid.center(v);
  return reach::hover_set(world.reach, world.grid, world.distance, world.bounds, p_W, world.constant_margin).clearance;
}

/// At least the clearance of the hover set at a voxel's centre, without looking for obstacles: the set holds a point no
/// farther from the centre than a mean push shifts it, and with `distance` single precision.
double clearance_at_most(const World& world, const Index3& v) {
  const auto& vehicle = world.reach.vehicle;
  if (!world.bounds.extension().none()) return kClearanceCap;
  return std::min(kClearanceCap, world.distance.at(v) + 1e-5 - vehicle.body.radius - vehicle.estimation.position);
}

const std::array<Index3, 6> kNeighbours = {Index3{1, 0, 0},  Index3{-1, 0, 0}, Index3{0, 1, 0},
                                           Index3{0, -1, 0}, Index3{0, 0, 1},  Index3{0, 0, -1}};

Region flood(const World& world, std::size_t seed, std::uint32_t number, std::vector<Regions::Number>& of_voxel) {
  const auto& grid = world.grid;
  const Vec3 half = Vec3::Constant(grid.resolution() / 2);
  Region region;
  region.low_W = region.high_W = region.widest_W = grid.center(grid.voxel(seed));
  region.widest_clearance_m = clearance(world, grid.voxel(seed));
  std::vector<std::size_t> open = {seed};
  of_voxel[seed] = number;
  while (!open.empty()) {
    const Index3 v = grid.voxel(open.back());
    open.pop_back();
    const Vec3 p = grid.center(v);
    region.voxels += 1;
    region.low_W = region.low_W.cwiseMin(p - half), region.high_W = region.high_W.cwiseMax(p + half);
    if (clearance_at_most(world, v) > region.widest_clearance_m) {
      if (const double c = clearance(world, v); c > region.widest_clearance_m) {
        region.widest_clearance_m = c;
        region.widest_W = p;
      }
    }
    for (const auto& step : kNeighbours) {
      const Index3 next = v + step;
      if (!world.hover.safe(next) || of_voxel[grid.linear(next)]) continue;
      of_voxel[grid.linear(next)] = number;
      open.push_back(grid.linear(next));
    }
  }
  region.volume_m3 = static_cast<double>(region.voxels) * std::pow(grid.resolution(), 3);
  return region;
}

/// Width of a voxel on a way: hover-safe ones by the clearance of their set, all others below every safe one.
struct Width {
  bool safe;
  double metres;
  auto operator<=>(const Width&) const = default;
};

Width width(const World& world, const Index3& v) {
  if (world.hover.safe(v)) return {true, clearance(world, v)};
  return {false, world.distance.at(v)};
}

}  // namespace

Regions hover_regions(const World& world) {
  Regions found{{}, std::vector<Regions::Number>(world.grid.cell_count())};
  for (std::size_t i = 0; i < found.of_voxel.size(); ++i) {
    if (found.of_voxel[i] || !world.hover.safe(world.grid.voxel(i))) continue;
    found.regions.push_back(flood(world, i, static_cast<std::uint32_t>(found.regions.size()), found.of_voxel));
  }
  std::vector<std::uint32_t> order(found.regions.size()), rank(order.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return found.regions[a].voxels > found.regions[b].voxels; });
  std::vector<Region> sorted;
  for (std::uint32_t n = 0; n < order.size(); ++n) {
    sorted.push_back(found.regions[order[n]]);
    rank[order[n]] = n;
  }
  for (Regions::Number& region : found.of_voxel) {
    if (region) region = rank[*region];
  }
  found.regions = std::move(sorted);
  return found;
}

std::optional<Bottleneck> widest_way(const World& world, const Vec3& from_W, const Vec3& to_W) {
  const auto& grid = world.grid;
  const Index3 from = grid.index(from_W), to = grid.index(to_W);
  if (!grid.free(from) || !grid.free(to)) return std::nullopt;
  constexpr auto kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> parent(grid.cell_count(), kNone);
  std::vector<char> closed(grid.cell_count());
  using Entry = std::pair<Width, std::size_t>;
  std::priority_queue<Entry> open;
  open.push({width(world, from), grid.linear(from)});
  parent[grid.linear(from)] = grid.linear(from);
  const std::size_t goal = grid.linear(to);
  while (!open.empty() && !closed[goal]) {
    const auto [widest, i] = open.top();
    open.pop();
    if (closed[i]) continue;
    closed[i] = 1;
    for (const auto& step : kNeighbours) {
      const Index3 next = grid.voxel(i) + step;
      if (!grid.free(next) || parent[grid.linear(next)] != kNone) continue;
      // The first parent popped is the widest one, so a voxel need not be pushed twice.
      parent[grid.linear(next)] = i;
      open.push({std::min(widest, width(world, next)), grid.linear(next)});
    }
  }
  if (!closed[goal]) return std::nullopt;
  std::size_t tightest = goal;
  double length = 0;
  for (std::size_t i = goal;; i = parent[i]) {
    if (width(world, grid.voxel(i)) < width(world, grid.voxel(tightest))) tightest = i;
    if (parent[i] == i) break;
    length += grid.resolution();
  }
  const Vec3 place = grid.center(grid.voxel(tightest));
  return Bottleneck{world.hover.safe(grid.voxel(tightest)), place, clearance(world, grid.voxel(tightest)),
                    world.distance.exact(grid, place), length};
}

SetCost cost_of_set(const World& world) {
  const auto& [grid, reach] = std::tie(world.grid, world.reach);
  const double taken = reach.vehicle.body.radius + reach.vehicle.estimation.position;
  SetCost cost;
  std::vector<double> given_up;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    if (grid.at(n) != map::Cell::free || world.distance.at(n) <= taken) continue;
    const Index3 v = grid.voxel(n);
    PerDirection h = world.bounds.at(v).w;
    for (std::size_t d = 0; d < kDirections; ++d) h[d] *= d == kZ ? reach.vertical.h_inf : reach.horizontal.h_inf;
    // The prism holds its centre, so it is no farther from obstacles, and no nearer than its circumradius makes it.
    const double free = world.distance.at(n), circumradius = Vec3(h[kX], h[kY], h[kZ]).norm();
    const double limit = std::min(kClearanceCap + taken, free + 1e-5);
    const bool far = free - 1e-5 - circumradius >= kClearanceCap + taken;
    const double at_centre = far ? kClearanceCap : reach::prism_distance(grid, grid.center(v), h, limit) - taken;
    if (!(at_centre > 0)) continue;
    ++cost.safe_at_centre;
    if (!world.hover.safe(v)) {
      ++cost.lost;
    } else if (at_centre < kClearanceCap) {
      given_up.push_back(at_centre - clearance(world, v));
    }
  }
  if (given_up.empty()) return cost;
  std::sort(given_up.begin(), given_up.end());
  cost.median_m = given_up[given_up.size() / 2];
  cost.quantile95_m = given_up[given_up.size() * 95 / 100];
  return cost;
}

namespace {

/// Whether the set's clearance is positive. A world by sets of method tight knows it; else it is looked for.
bool safe_by_sets(const World& world, const reach::HoverSet& set, const Index3& v) {
  if (!world.constant_margin && world.reach.method == reach::Method::tight) return world.hover.safe(v);
  return set.bounded &&
         reach::hover_set(world.reach, world.grid, world.distance, world.bounds, world.grid.center(v)).safe();
}

}  // namespace

std::vector<AgainstMargin> set_against_margins(const World& world, const std::vector<double>& margins_m) {
  const auto& [grid, reach] = std::tie(world.grid, world.reach);
  const double taken = reach.vehicle.body.radius + reach.vehicle.estimation.position;
  std::vector<AgainstMargin> result;
  for (const double margin : margins_m) result.push_back({margin});
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    if (grid.at(n) != map::Cell::free || world.distance.at(n) <= taken) continue;
    const Index3 v = grid.voxel(n);
    const auto set = reach::hover_extent(reach, grid, world.distance, world.bounds, grid.center(v));
    const bool set_safe = safe_by_sets(world, set, v);
    const auto& h = set.half_widths;
    const double nearest = std::ranges::min(h), corner = Vec3(h[kX], h[kY], h[kZ]).norm();  // at least the farthest
    for (auto& against : result) {
      ++against.voxels;
      const bool ball_safe = world.distance.at(n) > taken + against.margin_m;
      against.only_ball_safe += ball_safe && !set_safe;
      against.only_set_safe += set_safe && !ball_safe;
      if (!set.bounded) {
        ++against.unbounded;
      } else {
        against.ball_inside_set += nearest >= against.margin_m;
        against.set_inside_ball += corner <= against.margin_m;
      }
    }
  }
  return result;
}

std::optional<HoverPair> farthest_pair(const World& world, const Regions& regions,
                                       const std::function<bool(const Vec3&)>& can_take_off) {
  const auto& grid = world.grid;
  // One hover point a column: the voxel of the largest region with the largest clearance.
  std::vector<Vec3> candidates;
  for (int j = 0; j < grid.size().y(); ++j) {
    for (int i = 0; i < grid.size().x(); ++i) {
      double widest = 0;
      std::optional<Vec3> best;
      for (int k = 0; k < grid.size().z(); ++k) {
        const Index3 v(i, j, k);
        if (regions.of_voxel[grid.linear(v)] != 0u || (best && clearance_at_most(world, v) <= widest)) continue;
        const double c = clearance(world, v);
        if (!best || c > widest) widest = c, best = grid.center(v);
      }
      if (best) candidates.push_back(*best);
    }
  }
  const auto farthest_first = [&candidates](const Vec3& from) {
    std::stable_sort(candidates.begin(), candidates.end(), [&from](const Vec3& a, const Vec3& b) {
      return (a - from).squaredNorm() > (b - from).squaredNorm();
    });
  };
  if (candidates.empty()) return std::nullopt;
  farthest_first(Vec3(candidates.front()));
  const auto start = std::find_if(candidates.begin(), candidates.end(), can_take_off);
  if (start == candidates.end()) return std::nullopt;
  const Vec3 start_W = *start;
  farthest_first(start_W);
  return HoverPair{start_W, candidates.front()};
}

}  // namespace backwash::plan

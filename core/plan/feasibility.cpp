// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/feasibility.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include "core/reach/clearance.hpp"

namespace backwash::plan {
namespace {

using reach::kHoverClearanceCap;

constexpr double kDistanceRounding = 1e-5;  // m, more than any of a distance, single precision included

/// Clearance of the hover set at a voxel's centre, m.
double clearance(const World& world, const Index3& v) {
  const Vec3 p_W = world.grid.center(v);
  return reach::hover_set(world.reach, world.grid, world.distance, world.bounds, p_W, world.constant_margin,
                          &world.sums)
      .clearance;
}

/// At least the clearance of the hover set at a voxel's centre, without looking for obstacles: the set holds a point no
/// farther from the centre than a mean push shifts it, and with `distance` single precision.
double clearance_at_most(const World& world, const Index3& v) {
  if (!world.bounds.extension().none()) return kHoverClearanceCap;
  return std::min(kHoverClearanceCap,
                  world.distance.at(v) + kDistanceRounding - reach::body_and_estimation(world.reach.vehicle));
}

/// Whether sets are prisms around voxel centres.
bool plain_sets(const World& world) { return !world.constant_margin && world.bounds.extension().none(); }

/// Whether the clearance at a hover-safe voxel is larger than that. Precondition: plain_sets.
bool clear_by(const World& world, const Index3& v, double metres) {
  const Vec3 p_W = world.grid.center(v);
  const auto h = reach::hover_extent(world.reach, world.grid, world.distance, world.bounds, p_W).half_widths;
  const double least = metres + reach::body_and_estimation(world.reach.vehicle);
  const Vec3 half(h[kX], h[kY], h[kZ]), box = half + Vec3::Constant(std::max(0.0, least));  // holds all within that
  return world.distance.at(v) - half.norm() - kDistanceRounding > least || world.sums.box_free(p_W - box, p_W + box) ||
         reach::prism_clear(world.grid, world.sums, p_W, h, least);
}

/// The clearance at a hover-safe voxel, m, if it is larger than `metres`.
std::optional<double> wider_than(const World& world, const Index3& v, double metres) {
  if (clearance_at_most(world, v) <= metres) return std::nullopt;
  if (plain_sets(world) && !clear_by(world, v, metres - kDistanceRounding)) return std::nullopt;
  const double c = clearance(world, v);
  return c > metres ? std::optional(c) : std::nullopt;
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
    region.low_W = region.low_W.cwiseMin(p - half);
    region.high_W = region.high_W.cwiseMax(p + half);
    if (const auto wider = wider_than(world, v, region.widest_clearance_m)) {
      region.widest_clearance_m = *wider;
      region.widest_W = p;
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

/// At least that, without looking for obstacles.
Width width_at_most(const World& world, const Index3& v) {
  return world.hover.safe(v) ? Width{true, clearance_at_most(world, v) + kDistanceRounding} : width(world, v);
}

/// min(width, `cap`), by one look where the set is wider.
Width width_up_to(const World& world, const Index3& v, const Width& cap) {
  if (cap.safe && plain_sets(world) && clear_by(world, v, cap.metres + kDistanceRounding)) return cap;
  return std::min(cap, width(world, v));
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
  std::vector<char> exact(grid.cell_count()), closed = exact;
  using Entry = std::pair<Width, std::size_t>;
  std::priority_queue<Entry> open;
  open.push({width_at_most(world, from), grid.linear(from)});
  parent[grid.linear(from)] = grid.linear(from);
  const std::size_t goal = grid.linear(to);
  while (!open.empty() && !closed[goal]) {
    const auto [widest, i] = open.top();
    open.pop();
    if (closed[i]) continue;
    // Widths are looked at when they matter: an exact one on top is no narrower than all others can be.
    if (!std::exchange(exact[i], 1)) {
      open.push({width_up_to(world, grid.voxel(i), widest), i});
      continue;
    }
    closed[i] = 1;
    for (const auto& step : kNeighbours) {
      const Index3 next = grid.voxel(i) + step;
      if (!grid.free(next) || parent[grid.linear(next)] != kNone) continue;
      // The first parent popped is the widest one, so a voxel need not be pushed twice.
      parent[grid.linear(next)] = i;
      open.push({std::min(widest, width_at_most(world, next)), grid.linear(next)});
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
        if (regions.of_voxel[grid.linear(v)] != 0u) continue;
        const auto wider = best ? wider_than(world, v, widest) : clearance(world, v);
        if (wider) {
          widest = *wider;
          best = grid.center(v);
        }
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

// SPDX-License-Identifier: BSD-3-Clause
#include "research/feasibility/set_cost.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include "core/reach/clearance.hpp"
#include "core/reach/response/integrator.hpp"

namespace backwash::plan {
namespace {

using reach::body_and_estimation, reach::kHoverClearanceCap;

constexpr double kSetRounding = 1e-9;     // m, more than any of a distance in double precision
constexpr double kStoredRounding = 1e-5;  // m, more than any of a stored distance: single precision

/// add(world, voxel, sum) for all voxels, with one sum a layer of them that starts as `empty`.
template <class Sum, class Add>
std::vector<Sum> by_layers(const World& world, const Parallel& parallel, const Sum& empty, const Add& add) {
  const auto layers = static_cast<std::size_t>(world.grid.size().z());
  const std::size_t voxels = world.grid.cell_count() / layers;
  std::vector<Sum> sums(layers, empty);
  parallel(layers, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      for (std::size_t n = k * voxels; n < (k + 1) * voxels; ++n) add(world, n, sums[k]);
  });
  return sums;
}

/// At most how much clearance Σ over the set takes at a voxel, m.
struct GivenUp {
  double at_most;
  std::size_t voxel;
};

/// Half widths of the set with Σ at a voxel's centre, m; `net`: with what an integrator holds.
PerDirection set_at_centre(const World& world, const reach::NetDisturbance& net, const Index3& v) {
  PerDirection h = net(net.held() ? world.bounds.max_without_push_over(Vec3::Zero(), v, v) : world.bounds.at(v)).w;
  for (std::size_t d = 0; d < kDirections; ++d)
    h[d] *= d == kZ ? world.reach.vertical.h_inf : world.reach.horizontal.h_inf;
  return h;
}

/// Clearance of the set with Σ at a voxel's centre, m, if it is below the cap. The prism holds its centre, so it is no
/// farther from obstacles, and no nearer than its circumradius makes it.
std::optional<double> clearance_at_centre(const World& world, std::size_t n, const PerDirection& h) {
  const Index3 v = world.grid.voxel(n);
  const double taken = body_and_estimation(world.reach.vehicle), free = world.distance.at(v),
               cap = kHoverClearanceCap + taken;
  if (free - kStoredRounding - Vec3(h[kX], h[kY], h[kZ]).norm() >= cap) return std::nullopt;
  const Vec3 p_W = world.grid.center(v);
  const double found =
      reach::prism_distance(world.grid, p_W, h, std::min(cap, free + kStoredRounding), &world.sums) - taken;
  return found < kHoverClearanceCap ? std::optional(found) : std::nullopt;
}

/// At most how far points of a set lie from one within it: shrunk by the least ratio of their half widths, level and
/// upright ones apart, the outer set fits into the inner one.
double farthest_between(const PerDirection& inner, const PerDirection& outer) {
  double level = 1;
  for (std::size_t d = 0; d < kDirections; ++d)
    if (d != kZ) level = std::min(level, inner[d] / outer[d]);
  return Vec3((1 - level) * outer[kX], (1 - level) * outer[kY], outer[kZ] - inner[kZ]).norm();
}

/// What is given up at voxels, most of which are looked at by their bounds alone: the largest bounds first.
class Quantiles {
 public:
  Quantiles(std::vector<GivenUp> some, std::size_t nothing, std::function<double(std::size_t)> exact)
      : some_(std::move(some)), nothing_(nothing), exact_(std::move(exact)) {
    std::ranges::sort(some_, std::greater{}, &GivenUp::at_most);
  }
  /// Not below `percent` of all, ties included; 0 of none.
  double at(std::size_t percent, const Parallel& parallel) {
    const std::size_t all = some_.size() + nothing_, larger = all - 1 - all * percent / 100;
    if (all == 0 || larger >= some_.size()) return 0;
    for (;; look_at(values_.size() + some_.size() / 64 + 1, parallel)) {
      if (larger >= values_.size()) look_at(larger + 1, parallel);
      const auto value = values_.begin() + static_cast<std::ptrdiff_t>(larger);
      std::nth_element(values_.begin(), value, values_.end(), std::greater{});
      if (values_.size() == some_.size() || *value >= some_[values_.size()].at_most) return *value;
    }
  }

 private:
  /// So many of them are known. In the order of the map: neighbours read the same memory.
  void look_at(std::size_t count, const Parallel& parallel) {
    const std::size_t known = values_.size();
    values_.resize(std::min(some_.size(), count));
    const auto at = [this](std::size_t n) { return some_.begin() + static_cast<std::ptrdiff_t>(n); };
    std::ranges::sort(at(known), at(values_.size()), {}, &GivenUp::voxel);
    parallel(values_.size() - known, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = known + begin; n < known + end; ++n) values_[n] = exact_(some_[n].voxel);
    });
  }
  std::vector<GivenUp> some_;
  std::size_t nothing_;
  std::function<double(std::size_t)> exact_;
  std::vector<double> values_;  // of the first ones, in any order
};

/// cost_of_set's counts over a part of the map.
struct CostOfLayer {
  std::size_t safe = 0, lost = 0, nothing = 0;
  std::vector<GivenUp> some;
};

void add_cost(const World& world, const reach::NetDisturbance& net, std::size_t n, CostOfLayer& cost) {
  const Index3 v = world.grid.voxel(n);
  const double taken = body_and_estimation(world.reach.vehicle), free = world.distance.at(v);
  if (world.grid.at(n) != map::Cell::free || free <= taken) return;
  const Vec3 p_W = world.grid.center(v);
  const PerDirection h = set_at_centre(world, net, v);
  const bool safe = world.hover.safe(v),
             plain = world.bounds.extension().none();  // plain: the set holds that at its centre
  if (!(safe && plain) && !reach::prism_clear(world.grid, world.sums, p_W, h, taken)) return;
  ++cost.safe;
  cost.lost += !safe;
  if (!safe || (free + kStoredRounding - taken >= kHoverClearanceCap && !clearance_at_centre(world, n, h))) return;
  if (!plain) return cost.some.push_back({std::numeric_limits<double>::infinity(), n});
  const auto set = reach::hover_extent(world.reach, world.grid, world.distance, world.bounds, p_W);
  if (set.half_widths == h) {
    ++cost.nothing;
  } else {
    cost.some.push_back({farthest_between(h, set.half_widths) + kSetRounding, n});
  }
}

}  // namespace

SetCost cost_of_set(const World& world, const Parallel& parallel) {
  const reach::NetDisturbance net(world.reach, world.bounds);
  const auto layers =
      by_layers(world, parallel, CostOfLayer{},
                [&net](const World& w, std::size_t n, CostOfLayer& cost) { add_cost(w, net, n, cost); });
  SetCost cost;
  std::vector<GivenUp> some;
  std::size_t nothing = 0;
  for (const auto& layer : layers) {
    cost.safe_at_centre += layer.safe;
    cost.lost += layer.lost;
    nothing += layer.nothing;
    some.insert(some.end(), layer.some.begin(), layer.some.end());
  }
  Quantiles given_up(std::move(some), nothing, [&world, &net](std::size_t n) {
    const Index3 v = world.grid.voxel(n);
    const auto set = reach::hover_set(world.reach, world.grid, world.distance, world.bounds, world.grid.center(v),
                                      std::nullopt, &world.sums);
    return clearance_at_centre(world, n, set_at_centre(world, net, v)).value() - set.clearance;
  });
  cost.median_m = given_up.at(50, parallel);
  cost.quantile95_m = given_up.at(95, parallel);
  return cost;
}

namespace {

/// Whether the set's clearance is positive. A world by sets of method tight knows it; else it is looked for.
bool safe_by_sets(const World& world, const reach::HoverSet& set, const Index3& v) {
  if (!world.constant_margin && world.reach.method == reach::Method::tight) return world.hover.safe(v);
  return set.bounded &&
         reach::hover_set(world.reach, world.grid, world.distance, world.bounds, world.grid.center(v)).safe();
}

void add_comparison(const World& world, std::size_t n, std::vector<AgainstMargin>& result) {
  const Index3 v = world.grid.voxel(n);
  const double taken = body_and_estimation(world.reach.vehicle), free = world.distance.at(v);
  if (world.grid.at(n) != map::Cell::free || free <= taken) return;
  const auto set = reach::hover_extent(world.reach, world.grid, world.distance, world.bounds, world.grid.center(v));
  const bool set_safe = safe_by_sets(world, set, v);
  const auto& h = set.half_widths;
  const double nearest = std::ranges::min(h), corner = Vec3(h[kX], h[kY], h[kZ]).norm();  // at least the farthest
  for (auto& against : result) {
    ++against.voxels;
    const bool ball_safe = free > taken + against.margin_m;
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

}  // namespace

std::vector<AgainstMargin> set_against_margins(const World& world, const std::vector<double>& margins_m,
                                               const Parallel& parallel) {
  std::vector<AgainstMargin> result;
  result.reserve(margins_m.size());
  for (const double margin : margins_m) result.push_back({margin});
  for (const auto& layer : by_layers(world, parallel, result, add_comparison)) {
    for (std::size_t n = 0; n < result.size(); ++n) {
      auto& sum = result[n];
      const auto& part = layer[n];
      sum.voxels += part.voxels;
      sum.unbounded += part.unbounded;
      sum.ball_inside_set += part.ball_inside_set;
      sum.set_inside_ball += part.set_inside_ball;
      sum.only_ball_safe += part.only_ball_safe;
      sum.only_set_safe += part.only_set_safe;
    }
  }
  return result;
}

}  // namespace backwash::plan

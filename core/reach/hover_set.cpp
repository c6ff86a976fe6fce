// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/hover_set.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/loop/position_loop.hpp"
#include "core/reach/bound/block_extents.hpp"
#include "core/reach/clearance.hpp"
#include "core/reach/ellipsoid.hpp"
#include "core/reach/rest.hpp"

namespace backwash::reach {
namespace {

/// Half widths of the infinite-time set under a constant bound, m. Both kinds grow with the bound.
struct ConstantHalfWidths {
  explicit ConstantHalfWidths(const Reachability& reach, double times = 1)
      : horizontal(times * reach.horizontal.h_inf), vertical(times * reach.vertical.h_inf) {}
  PerDirection operator()(const DisturbanceBound& w_bar) const noexcept {
    PerDirection h;
    for (std::size_t d = 0; d < kDirections; ++d) h[d] = (d == kZ ? vertical : horizontal) * w_bar.w[d];
    return h;
  }
  double horizontal, vertical;
};

PerDirection supports(const Vec3& half_axes) {
  PerDirection h;
  for (std::size_t d = 0; d < kDirections; ++d) {
    h[d] = unit(static_cast<Direction>(d)).cwiseProduct(half_axes).norm();
  }
  return h;
}

Vec3 channels(const DisturbanceBound& w_bar) { return {w_bar.w[kX], w_bar.w[kY], w_bar.w[kZ]}; }

Vec3 box(const PerDirection& half_widths) { return {half_widths[kX], half_widths[kY], half_widths[kZ]}; }

/// Where a set hovering at p has its centre, from p: static answer of the loop to the mean push.
Vec3 static_shift(const Vehicle& vehicle, const Vec3& push_W) {
  if (has_integrator(vehicle)) return Vec3::Zero();
  return push_W.cwiseQuotient(loop::PositionLoop(vehicle).kp);
}

/// Clearance of a set, exact up to the cap. The distance field brackets the answer: the set holds p, so it is no
/// farther from obstacles than p, and no nearer than p less the set's circumradius.
double set_clearance(const Vehicle& vehicle, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                     const Vec3& p_W, const PerDirection& half_widths, const map::OccupancySums* sums) {
  const Index3 v = grid.index(p_W);
  const double off_center = (p_W - grid.center(v)).norm() + 1e-6;  // the field is stored in single precision
  const double taken = body_and_estimation(vehicle);
  if (distance.at(v) - off_center - box(half_widths).norm() >= kHoverClearanceCap + taken) return kHoverClearanceCap;
  const double limit = std::min(kHoverClearanceCap + taken, distance.at(v) + off_center);
  return prism_distance(grid, p_W, half_widths, limit, sums) - taken;
}

/// Boxes of voxels around a point of voxel v.
class NearbyVoxels {
 public:
  NearbyVoxels(const map::OccupancyGrid& grid, const Index3& v, const Vec3& p_W)
      : v_(v),
        resolution_(grid.resolution()),
        per_voxel_(1 / grid.resolution()),
        over_low_((p_W - grid.center(v)) * per_voxel_ + Vec3::Constant(0.5)) {}

  double resolution() const noexcept { return resolution_; }
  struct Voxels {
    bool operator==(const Voxels&) const = default;
    Index3 low, high;
  };
  /// Those, closed cubes, that the box p ± h meets.
  Voxels meeting(const Vec3& h) const noexcept {
    Voxels voxels;
    for (int axis = 0; axis < 3; ++axis) {
      const double reach = h[axis] * per_voxel_;
      voxels.low[axis] = v_[axis] - static_cast<int>(reach + 1 - over_low_[axis]);
      voxels.high[axis] = v_[axis] + static_cast<int>(reach + over_low_[axis]);
    }
    return voxels;
  }

 private:
  Index3 v_;
  double resolution_, per_voxel_;
  Vec3 over_low_;  // p less the low corner of v, in voxels
};

/// Half widths of the smallest fixed point, m; nothing if they exceed the free distance. Monotone iteration from below
/// ends there: the maxima only grow, through finitely many boxes of voxels. `v`: the
/// centre's voxel, free; `free_distance`: there; `push_W`: that put the centre there.
template <typename HalfWidths>
std::optional<PerDirection> fixed_point(const HalfWidths& half_widths, double free_distance, const BoundField& bounds,
                                        const NetDisturbance& net, const NearbyVoxels& around, const Index3& v,
                                        const Vec3& push_W) {
  const bool extended = !bounds.extension().none();
  auto over = around.meeting(Vec3::Zero());
  DisturbanceBound w_bar{};
  for (;;) {
    const DisturbanceBound found = net.held() ? net(bounds.max_without_push_over(Vec3::Zero(), over.low, over.high))
                                   : extended ? bounds.max_about_voxels(push_W, Vec3::Zero(), over.low, over.high)
                                   : over.low == over.high ? bounds.at(v)
                                                           : bounds.max_over_voxels(over.low, over.high);
    // Holds by itself but for rounding in the ellipsoid's scalar root, which must not make the iteration cycle.
    for (std::size_t d = 0; d < kDirections; ++d) w_bar.w[d] = std::max(found.w[d], w_bar.w[d]);
    const PerDirection h = half_widths(w_bar);
    // An infinite bound's may be no numbers: those exceed it, too.
    if (!(box(h).array() <= free_distance + around.resolution()).all()) return std::nullopt;
    const auto wider = around.meeting(box(h));
    if (wider == over) return h;
    over = wider;
  }
}

/// Centre of a set, its voxel, and what pushes there.
struct Centre {
  Index3 v;
  Vec3 p_W, push_W;
  double distance;  // of the voxel's centre to obstacles, m
};

/// Whether sets around voxel centres are clear of obstacles by body and estimation. Box queries bracket the answer and
/// decide most; no rounding can make them wrong, since boxes within the fat set are a little smaller than that.
class ClearTest {
 public:
  ClearTest(const Vehicle& vehicle, const map::OccupancyGrid& grid, const map::OccupancySums& sums)
      : grid_(grid), sums_(sums), taken_(body_and_estimation(vehicle)) {}

  /// True only where a set that holds this one is not clear. `free_distance`: of the set's centre.
  bool blocked(const NearbyVoxels& around, double free_distance, const PerDirection& half_widths) const noexcept {
    if (!box(half_widths).allFinite()) return true;  // no voxels have such numbers
    if (far(free_distance, box(half_widths))) return false;
    const Octagon o(half_widths);
    const double t = taken_ * (1 - 1e-9);
    return !box_free(around, o.middle + Vec3(0, 0, t)) || !box_free(around, o.along_x + Vec3(t, 0, 0)) ||
           !box_free(around, o.along_y + Vec3(0, t, 0));
  }
  /// Whether sets that reach no farther along x, y and z end their iteration, and are clear by the centre's distance.
  bool far(double free_distance, const Vec3& half) const noexcept {
    return free_distance - half.norm() - 1e-6 > taken_;  // the field is stored in single precision
  }
  /// The same by boxes. True only where all of them are.
  bool surely_clear(const NearbyVoxels& around, double free_distance, const Vec3& most) const noexcept {
    return most.maxCoeff() <= free_distance && box_free(around, most + Vec3::Constant(taken_));
  }
  /// Exact. `p_W`: the set's centre.
  bool clear(const NearbyVoxels& around, const Vec3& p_W, double free_distance, const PerDirection& half_widths) const {
    if (far(free_distance, box(half_widths)) || box_free(around, box(half_widths) + Vec3::Constant(taken_)))
      return true;
    if (blocked(around, free_distance, half_widths)) return false;
    const Octagon o(half_widths);
    const double t = taken_ * (1 - 1e-9) / std::sqrt(2.0);
    if (!box_free(around, o.middle + Vec3(t, t, 0)) || !box_free(around, o.along_x + Vec3(t, 0, t)) ||
        !box_free(around, o.along_y + Vec3(0, t, t)))
      return false;
    return prism_clear(grid_, sums_, p_W, half_widths, taken_);
  }

 private:
  /// Half extents of boxes that an octagonal prism holds: two that reach its sides in x and y, one in between.
  struct Octagon {
    explicit Octagon(const PerDirection& h) {
      const double sum = std::sqrt(2.0) * std::min(h[kXyPlus], h[kXyMinus]);
      const double x = std::min(h[kX], sum), y = std::min(h[kY], sum), part = std::min(1.0, sum / (x + y));
      along_x = {x, std::min(y, sum - x), h[kZ]};
      along_y = {std::min(x, sum - y), y, h[kZ]};
      middle = {part * x, part * y, h[kZ]};
    }
    Vec3 along_x, along_y, middle;
  };
  bool box_free(const NearbyVoxels& around, const Vec3& half) const noexcept {
    const auto voxels = around.meeting(half);
    return sums_.voxels_free(voxels.low, voxels.high);
  }
  const map::OccupancyGrid& grid_;
  const map::OccupancySums& sums_;
  double taken_;
};

}  // namespace

HoverSet hover_extent(const Reachability& reach, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                      const BoundField& bounds, const Vec3& p_W, std::optional<double> constant_margin,
                      const ReachTube* arrival) {
  HoverSet set;
  set.clearance = -body_and_estimation(reach.vehicle);
  if (!grid.free(grid.index(p_W))) return set;
  const Vec3 push_W = bounds.push(p_W, Vec3::Zero());
  set.shift = static_shift(reach.vehicle, push_W);
  const Vec3 c_W = p_W + set.shift;
  const Index3 v = grid.index(c_W);
  if (!grid.free(v)) return set;
  if (constant_margin) {
    set.half_widths.fill(*constant_margin);
    set.bounded = true;
    return set;
  }
  const NearbyVoxels around(grid, v, c_W);
  const NetDisturbance net(reach, bounds);
  const auto smallest = [&](const auto& half_widths) {
    return fixed_point(half_widths, distance.at(v), bounds, net, around, v, push_W);
  };
  std::optional<PerDirection> h;
  if (reach.method == Method::paper) {
    h = smallest([&](const DisturbanceBound& w_bar) {
      auto widths = supports(hover_ellipsoid(reach.vehicle, channels(w_bar)).diagonal().cwiseSqrt());
      for (std::size_t d = 0; arrival && d < kDirections; ++d)
        widths[d] = std::max(widths[d], arrival->back().half_widths_interval[d]);
      return widths;
    });
  } else {
    h = arrival ? smallest(WidthsAtRest(reach, *arrival, c_W, bounds.model()))
                : smallest(ConstantHalfWidths(reach, bounds.model().at_rest()));
  }
  if (!h) return set;
  set.bounded = true;
  set.half_widths = *h;
  return set;
}

HoverSet hover_set(const Reachability& reach, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                   const BoundField& bounds, const Vec3& p_W, std::optional<double> constant_margin,
                   const map::OccupancySums* sums) {
  HoverSet set = hover_extent(reach, grid, distance, bounds, p_W, constant_margin);
  if (!set.bounded) return set;
  const Vec3 c_W = set.shift + p_W;
  const double taken = body_and_estimation(reach.vehicle);
  set.clearance = constant_margin ? std::min(kHoverClearanceCap, distance.exact(grid, c_W) - *constant_margin - taken)
                                  : set_clearance(reach.vehicle, grid, distance, c_W, set.half_widths, sums);
  return set;
}

HoverMap::HoverMap(const map::OccupancyGrid& grid)
    : safe_(grid.origin(), grid.resolution(), grid.size(), map::Cell::unknown) {}

void HoverMap::fill(const Reachability& reach, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                    const map::OccupancySums& sums, const BoundField& bounds, std::span<const std::size_t> voxels,
                    std::optional<double> constant_margin) {
  const double taken = body_and_estimation(reach.vehicle);
  const bool extended = !bounds.extension().none();
  const auto fill_where = [&](const auto& safe) {
    for (const std::size_t n : voxels) {
      const Index3 v = grid.voxel(n);
      const double here = distance.at(v);
      if (here <= taken) continue;  // not even a point fits
      Centre c{v, grid.center(v), Vec3::Zero(), here};
      if (extended) {
        c.push_W = bounds.push(c.p_W, Vec3::Zero());
        c.p_W += static_shift(reach.vehicle, c.push_W);
        c.v = grid.index(c.p_W);
        c.distance = distance.at(c.v);
        if (!grid.free(c.v) || c.distance <= 0) continue;
      }
      if (safe(c)) safe_.set(v, map::Cell::free);
    }
  };
  if (constant_margin) {
    // Stored distances are exact at centres, in single precision.
    return fill_where([&](const Centre& c) {
      const double free_distance = extended ? distance.exact(grid, c.p_W) : c.distance;
      return free_distance - 1e-6 > *constant_margin + taken;
    });
  }
  const ClearTest test(reach.vehicle, grid, sums);
  const NetDisturbance net(reach, bounds);
  const bool by_blocks = reach.method == Method::tight && !extended && !net.held();
  BlockExtents extents(reach, bounds, grid.size(), grid.resolution());
  const auto safe_with = [&](const auto& half_widths) {
    return [&](const Centre& c) {
      // A centre off its voxel's is nearer to obstacles by that much at most.
      const double free_distance = c.distance, off = extended ? (c.p_W - grid.center(c.v)).norm() : 0;
      const Vec3* const most = by_blocks ? &extents.at(c.v) : nullptr;
      if (most && test.far(free_distance, *most)) return true;
      const NearbyVoxels around(grid, c.v, c.p_W);
      if (most && test.surely_clear(around, free_distance, *most)) return true;
      // A part of the set, and cheap.
      if (test.blocked(around, free_distance - off, half_widths(net(bounds.at(c.v))))) return false;
      const auto h = fixed_point(half_widths, free_distance, bounds, net, around, c.v, c.push_W);
      return h && test.clear(around, c.p_W, free_distance - off, *h);
    };
  };
  if (reach.method == Method::tight) return fill_where(safe_with(ConstantHalfWidths(reach)));
  const HoverEllipsoid ellipsoid(reach.vehicle);
  fill_where(safe_with([&](const DisturbanceBound& w_bar) { return supports(ellipsoid.half_axes(channels(w_bar))); }));
}

void HoverMap::clear(const map::VoxelBox& box) noexcept {
  for (int k = box.low.z(); k <= box.high.z(); ++k)
    for (int j = box.low.y(); j <= box.high.y(); ++j)
      for (int i = box.low.x(); i <= box.high.x(); ++i) safe_.set({i, j, k}, map::Cell::unknown);
}

}  // namespace backwash::reach

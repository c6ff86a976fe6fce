// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/hover_set.hpp"

#include <algorithm>
#include <cmath>

#include "core/reach/clearance.hpp"
#include "core/reach/ellipsoid.hpp"

namespace backwash::reach {
namespace {

constexpr double kClearanceCap = 1.0;  // m

/// Half widths of the infinite-time set under a constant bound, m. Both kinds grow with the bound.
struct ExactHalfWidths {
  explicit ExactHalfWidths(const Reachability& reach)
      : horizontal(reach.horizontal.h_inf), vertical(reach.vertical.h_inf) {}
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

/// What is left of the distance to obstacles for clearance.
double body_and_estimation(const Vehicle& vehicle) { return vehicle.body.radius + vehicle.estimation.position; }

/// Clearance of a set, exact up to the cap. The distance field brackets the answer: the set holds p, so it is no
/// farther from obstacles than p, and no nearer than p less the set's circumradius. `at_most`: known to be no less than
/// the distance, or the cap of it.
double set_clearance(const Vehicle& vehicle, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                     const Vec3& p_W, const PerDirection& half_widths, double at_most) {
  const Index3 v = grid.index(p_W);
  const double off_center = (p_W - grid.center(v)).norm() + 1e-6;  // the field is stored in single precision
  const double taken = body_and_estimation(vehicle);
  if (distance.at(v) - off_center - box(half_widths).norm() >= kClearanceCap + taken) return kClearanceCap;
  const double limit = std::min({kClearanceCap + taken, at_most, distance.at(v) + off_center});
  return prism_distance(grid, p_W, half_widths, limit) - taken;
}

/// Monotone iteration from below ends at the smallest fixed point: the maxima only grow, through finitely many values.
/// Leaves the clearance of a bounded set open. `v`: voxel of p, free.
template <typename HalfWidths>
HoverSet fixed_point(const Vehicle& vehicle, const HalfWidths& half_widths, const map::OccupancyGrid& grid,
                     const map::DistanceField& distance, const BoundField& bounds, const Vec3& p_W, const Index3& v) {
  HoverSet set;
  set.clearance = -body_and_estimation(vehicle);
  const double free_distance = distance.at(v) + grid.resolution();
  // A box that stays this far inside the voxel of p meets no other.
  const double inside = grid.resolution() / 2 - (p_W - grid.center(v)).cwiseAbs().maxCoeff();
  DisturbanceBound w_bar = inside > 0 ? bounds.at(v) : bounds.max_over(p_W, p_W);
  for (;;) {
    set.half_widths = half_widths(w_bar);
    const Vec3 h = box(set.half_widths);
    if (h.maxCoeff() > free_distance) return set;
    if (h.maxCoeff() < inside * (1 - 1e-9)) break;
    DisturbanceBound over_set = bounds.max_over(p_W - h, p_W + h);
    // Holds by itself but for rounding in the ellipsoid's scalar root, which must not make the iteration cycle.
    for (std::size_t d = 0; d < kDirections; ++d) over_set.w[d] = std::max(over_set.w[d], w_bar.w[d]);
    if (over_set.w == w_bar.w) break;
    w_bar = over_set;
  }
  set.bounded = true;
  return set;
}

/// At least the distance of a set around the centre of v to obstacles: that of its tips along the axes. A tip may lie
/// up to a voxel before the next centre.
double distance_of_tips(const map::OccupancyGrid& grid, const map::DistanceField& distance, const Index3& v,
                        const PerDirection& h) {
  const double diagonal = std::sqrt(2.0) * std::min(h[kXyPlus], h[kXyMinus]);  // cuts the tips of x and y off
  const Vec3 tip(std::min(h[kX], diagonal), std::min(h[kY], diagonal), h[kZ]);
  double least = distance.at(v);
  for (int axis = 0; axis < 3; ++axis) {
    const int steps = static_cast<int>(tip[axis] / grid.resolution()) + 1;
    const double beyond = steps * grid.resolution() - tip[axis];
    const Index3 step = steps * Index3::Unit(axis);
    least = std::min(least, beyond + std::min(distance.at(v + step), distance.at(v - step)));
  }
  return least + 1e-6;  // the field is stored in single precision
}

}  // namespace

HoverSet hover_set(const Reachability& reach, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                   const BoundField& bounds, const Vec3& p_W, double constant_margin) {
  HoverSet set;
  const double taken = body_and_estimation(reach.vehicle);
  set.clearance = -taken;
  const Index3 v = grid.index(p_W);
  if (!grid.free(v)) return set;
  if (constant_margin >= 0) {
    set.half_widths.fill(constant_margin);
    set.clearance = std::min(kClearanceCap, distance.exact(grid, p_W) - constant_margin - taken);
    set.bounded = true;
    return set;
  }
  const auto paper = [&](const DisturbanceBound& w_bar) {
    return supports(hover_ellipsoid(reach.vehicle, channels(w_bar)).diagonal().cwiseSqrt());
  };
  set = reach.method == Method::tight
            ? fixed_point(reach.vehicle, ExactHalfWidths(reach), grid, distance, bounds, p_W, v)
            : fixed_point(reach.vehicle, paper, grid, distance, bounds, p_W, v);
  if (set.bounded) {
    set.clearance = set_clearance(reach.vehicle, grid, distance, p_W, set.half_widths, kClearanceCap + taken);
  }
  return set;
}

HoverMap::HoverMap(const map::OccupancyGrid& grid) : size_(grid.size()), cells_(grid.cell_count(), kNotComputed) {}

void HoverMap::fill(const Reachability& reach, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                    const BoundField& bounds, std::span<const std::size_t> voxels, double constant_margin) {
  const auto store = [&](std::size_t n, const HoverSet& set) {
    const Vec3 h = set.bounded ? box(set.half_widths) : Vec3::Zero();
    cells_[n] = {static_cast<float>(set.clearance), static_cast<float>(h.x()), static_cast<float>(h.y()),
                 static_cast<float>(h.z())};
  };
  if (constant_margin >= 0) {
    for (const std::size_t n : voxels) {
      store(n, hover_set(reach, grid, distance, bounds, grid.center(grid.voxel(n)), constant_margin));
    }
    return;
  }
  const double taken = body_and_estimation(reach.vehicle);
  const auto fill_with = [&](const auto& half_widths) {
    for (const std::size_t n : voxels) {
      const Index3 v = grid.voxel(n);
      const double free_distance = distance.at(v);
      if (free_distance <= taken) {  // not even a point fits
        cells_[n] = {static_cast<float>(std::min(free_distance, taken * (1 - 1e-6)) - taken), 0, 0, 0};
        continue;
      }
      const Vec3 p_W = grid.center(v);
      HoverSet set = fixed_point(reach.vehicle, half_widths, grid, distance, bounds, p_W, v);
      if (set.bounded) {
        const double at_most = distance_of_tips(grid, distance, v, set.half_widths);
        set.clearance = at_most <= taken ? at_most - taken
                                         : set_clearance(reach.vehicle, grid, distance, p_W, set.half_widths, at_most);
      }
      store(n, set);
    }
  };
  if (reach.method == Method::tight) return fill_with(ExactHalfWidths(reach));
  const HoverEllipsoid ellipsoid(reach.vehicle);
  fill_with([&](const DisturbanceBound& w_bar) { return supports(ellipsoid.half_axes(channels(w_bar))); });
}

bool HoverMap::inside(const Index3& v) const noexcept {
  return (v.array() >= 0).all() && (v.array() < size_.array()).all();
}

std::size_t HoverMap::linear(const Index3& v) const noexcept {
  const auto row =
      static_cast<std::size_t>(v.y()) + static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(v.z());
  return static_cast<std::size_t>(v.x()) + static_cast<std::size_t>(size_.x()) * row;
}

const std::array<float, 4>& HoverMap::cell(const Index3& v) const noexcept { return cells_[linear(v)]; }

void HoverMap::clear(const map::VoxelBox& box) noexcept {
  for (int k = box.low.z(); k <= box.high.z(); ++k)
    for (int j = box.low.y(); j <= box.high.y(); ++j)
      for (int i = box.low.x(); i <= box.high.x(); ++i) cells_[linear({i, j, k})] = kNotComputed;
}

bool HoverMap::safe(const Index3& v) const noexcept { return clearance(v) > 0; }

double HoverMap::clearance(const Index3& v) const noexcept { return inside(v) ? cell(v)[0] : kNotComputed[0]; }

Vec3 HoverMap::half_widths(const Index3& v) const noexcept {
  if (!inside(v)) return Vec3::Zero();
  const auto& c = cell(v);
  return {c[1], c[2], c[3]};
}

}  // namespace backwash::reach

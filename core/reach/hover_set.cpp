// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/hover_set.hpp"

#include <algorithm>
#include <cmath>

#include "core/reach/clearance.hpp"
#include "core/reach/ellipsoid.hpp"

namespace backwash::reach {
namespace {

constexpr double kClearanceCap = 1.0;  // m

/// Half widths of the infinite-time set under a constant bound, m.
PerDirection infinite_time_half_widths(const Reachability& reach, const DisturbanceBound& w_bar) {
  PerDirection h{};
  if (reach.method == Method::paper) {
    const Mat3 Q = hover_ellipsoid(reach.vehicle, {w_bar.w[kX], w_bar.w[kY], w_bar.w[kZ]});
    for (std::size_t d = 0; d < kDirections; ++d) {
      const Vec3 n = unit(static_cast<Direction>(d));
      h[d] = std::sqrt(n.dot(Q * n));
    }
  } else {
    for (std::size_t d = 0; d < kDirections; ++d) {
      h[d] = (d == kZ ? reach.vertical : reach.horizontal).h_inf * w_bar.w[d];
    }
  }
  return h;
}

Vec3 box(const PerDirection& half_widths) { return {half_widths[kX], half_widths[kY], half_widths[kZ]}; }

/// What is left of the distance to obstacles for clearance.
double body_and_estimation(const Vehicle& vehicle) { return vehicle.body.radius + vehicle.estimation.position; }

/// Clearance of a set, exact up to the cap. The distance field brackets the answer: the set holds p, so it is no
/// farther from obstacles than p, and no nearer than p less the set's circumradius.
double set_clearance(const Vehicle& vehicle, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                     const Vec3& p_W, const PerDirection& half_widths) {
  const Index3 v = grid.index(p_W);
  const double off_center = (p_W - grid.center(v)).norm() + 1e-6;  // the field is stored in single precision
  const double taken = body_and_estimation(vehicle);
  if (distance.at(v) - off_center - box(half_widths).norm() >= kClearanceCap + taken) return kClearanceCap;
  const double limit = std::min(kClearanceCap + taken, distance.at(v) + off_center);
  return prism_distance(grid, p_W, half_widths, limit) - taken;
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
  // Monotone iteration from below ends at the smallest fixed point: the maxima only grow, through finitely many values.
  const double free_distance = distance.at(v) + grid.resolution();
  DisturbanceBound w_bar = bounds.max_over(p_W, p_W);
  for (;;) {
    set.half_widths = infinite_time_half_widths(reach, w_bar);
    const Vec3 h = box(set.half_widths);
    if (h.maxCoeff() > free_distance) return set;
    DisturbanceBound over_set = bounds.max_over(p_W - h, p_W + h);
    // Holds by itself but for rounding in the ellipsoid's scalar root, which must not make the iteration cycle.
    for (std::size_t d = 0; d < kDirections; ++d) over_set.w[d] = std::max(over_set.w[d], w_bar.w[d]);
    if (over_set.w == w_bar.w) break;
    w_bar = over_set;
  }
  set.bounded = true;
  set.clearance = set_clearance(reach.vehicle, grid, distance, p_W, set.half_widths);
  return set;
}

HoverMap::HoverMap(const map::OccupancyGrid& grid) : size_(grid.size()), cells_(grid.cell_count(), kNotComputed) {}

void HoverMap::fill(const Reachability& reach, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                    const BoundField& bounds, std::span<const std::size_t> voxels, double constant_margin) {
  for (const std::size_t n : voxels) {
    const Vec3 p_W = grid.center(grid.voxel(n));
    const HoverSet set = hover_set(reach, grid, distance, bounds, p_W, constant_margin);
    const Vec3 h = set.bounded ? box(set.half_widths) : Vec3::Zero();
    cells_[n] = {static_cast<float>(set.clearance), static_cast<float>(h.x()), static_cast<float>(h.y()),
                 static_cast<float>(h.z())};
  }
}

bool HoverMap::inside(const Index3& v) const noexcept {
  return (v.array() >= 0).all() && (v.array() < size_.array()).all();
}

const std::array<float, 4>& HoverMap::cell(const Index3& v) const noexcept {
  const auto row =
      static_cast<std::size_t>(v.y()) + static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(v.z());
  return cells_[static_cast<std::size_t>(v.x()) + static_cast<std::size_t>(size_.x()) * row];
}

bool HoverMap::safe(const Index3& v) const noexcept { return clearance(v) > 0; }

double HoverMap::clearance(const Index3& v) const noexcept { return inside(v) ? cell(v)[0] : kNotComputed[0]; }

Vec3 HoverMap::half_widths(const Index3& v) const noexcept {
  if (!inside(v)) return Vec3::Zero();
  const auto& c = cell(v);
  return {c[1], c[2], c[3]};
}

}  // namespace backwash::reach

// SPDX-License-Identifier: BSD-3-Clause
// Take-off and landing: the vertical corridor below the lowest clear hover height (docs/model.md section 4).
#include <algorithm>

#include "core/plan/search/ends.hpp"

namespace backwash::plan {

namespace {
constexpr double kLateralCap = 1.0;  ///< m
}

std::optional<TakeoffColumn> takeoff_column(const World& world, const Vec3& p_W, double least_clearance) {
  const auto& grid = world.grid;
  Index3 v = grid.index(p_W);
  if (!p_W.allFinite() || !grid.free(v)) return std::nullopt;
  while (grid.free(v - Index3::UnitZ())) --v.z();
  const double a = grid.resolution();
  const double z_floor = grid.origin().z() + a * v.z();
  for (; grid.free(v); ++v.z()) {
    const Vec3 hover_W(p_W.x(), p_W.y(), grid.center(v).z());
    if (may_rest_at(world, hover_W, least_clearance)) return TakeoffColumn{z_floor, hover_W.z()};
  }
  return std::nullopt;
}

double lateral_clearance(const World& world, const reach::ReachTube& tube) {
  return lateral_clearance(world.grid, world.reach.vehicle, world.constant_margin, tube);
}

double lateral_clearance(const map::OccupancyGrid& grid, const Vehicle& vehicle, std::optional<double> margin,
                         const reach::ReachTube& tube) {
  const double a = grid.resolution(), body = vehicle.body.radius + vehicle.estimation.position;
  double least = kLateralCap;
  for (std::size_t n = 0; n < tube.size(); ++n) {
    const Vec3& from = tube[n].center.p_W;
    const Vec3& to = tube[std::min(n + 1, tube.size() - 1)].center.p_W;
    const Vec3 middle = (from + to) / 2;
    PerDirection h = tube[n].half_widths_interval;
    if (margin) h.fill(*margin);
    for (std::size_t d = 0; d < kDirections; ++d) h[d] += std::abs(unit(static_cast<Direction>(d)).dot(to - from)) / 2;
    // Wider than the grid, without a bound, or no number: it meets the outside, and no voxels have such numbers.
    const double all = grid.size().maxCoeff() * a;
    if (!std::ranges::all_of(h, [&](double width) { return width < all; })) return -body;

    // Layers beside the body and the set: from the first free one under the centre, so that the floor does not count.
    const Index3 center = grid.index(middle);
    if (!grid.free(center)) return -body;
    const int lowest = grid.index(middle - Vec3(0, 0, h[kZ] + body)).z();
    const int highest = grid.index(middle + Vec3(0, 0, h[kZ] + body)).z();
    Index3 v = center;
    while (v.z() > lowest && grid.free(v - Index3::UnitZ())) --v.z();
    const int reach_x = static_cast<int>(std::ceil((h[kX] + body + least) / a)) + 1;
    const int reach_y = static_cast<int>(std::ceil((h[kY] + body + least) / a)) + 1;
    for (int k = v.z(); k <= highest; ++k)
      for (int j = center.y() - reach_y; j <= center.y() + reach_y; ++j)
        for (int i = center.x() - reach_x; i <= center.x() + reach_x; ++i) {
          if (grid.free({i, j, k})) continue;
          // Largest separation along the octagon's normals: its sign is exact, its value never too large.
          const Vec3 to_voxel = grid.center({i, j, k}) - middle;
          double gap = -std::numeric_limits<double>::infinity();
          for (const Direction d : {kX, kY, kXyPlus, kXyMinus}) {
            const Vec3 n_d = unit(d);
            gap = std::max(gap, std::abs(n_d.dot(to_voxel)) - h[d] - a / 2 * (std::abs(n_d.x()) + std::abs(n_d.y())));
          }
          least = std::min(least, gap - body);
        }
  }
  return least;
}

double takeoff_clearance(const World& world, const reach::ReachTube& tube, double z_safe, std::size_t from,
                         double apart) {
  const auto first = tube.begin() + static_cast<std::ptrdiff_t>(std::min(from, tube.size() - 1));
  const auto clear = std::find_if(first, tube.end() - 1, [&](const auto& s) { return s.center.p_W.z() >= z_safe; });
  return std::min(lateral_clearance(world, {first, clear}),
                  tube_clearance(world, tube, static_cast<std::size_t>(clear - tube.begin()), apart));
}

}  // namespace backwash::plan

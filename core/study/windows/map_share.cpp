// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/map_share.hpp"

#include <algorithm>
#include <cmath>

#include "core/log/columns/log_columns.hpp"
#include "core/map/voxel_box.hpp"
#include "core/study/windows/gates/window_rules.hpp"
#include "core/types/formatted.hpp"

namespace backwash::study {
namespace {

enum class Fits { good, inside, too_near, outside };

/// Looks at one height, the body a disc of `reach`, m; places are off by `tolerance`, m, at most.
Fits at_height(const map::OccupancyGrid& grid, const Vec3& p_W, double reach, double tolerance) {
  const auto within = [&](double radius) {
    const Vec3 level(radius, radius, 0);
    return map::common({grid.index(p_W - level), grid.index(p_W + level)}, map::all_of(grid.size()));
  };
  if (grid.occupied(grid.index(p_W))) return Fits::inside;
  bool known = grid.free(grid.index(p_W)), near = false;
  if (!known) map::for_each_voxel(within(tolerance), [&](const Index3& v) { known = known || grid.free(v); });
  if (!known) return Fits::outside;
  const double half = grid.resolution() / 2;
  map::for_each_voxel(within(std::max(0.0, reach)), [&](const Index3& v) {
    const Vec3 off = ((p_W - grid.center(v)).cwiseAbs().array() - half).max(0).matrix();
    near = near || (grid.occupied(v) && off.head<2>().norm() < reach);
  });
  return near ? Fits::too_near : Fits::good;
}

}  // namespace

bool MapShare::refused() const noexcept { return all() > kWindowRules.misplaced; }

MapShare map_share(const log::FlightLog& log, const map::OccupancyGrid& grid, const Vehicle& vehicle) {
  const double tolerance = grid.resolution() + vehicle.estimation.position;
  const double reach = vehicle.body.radius - tolerance;
  const Vec3 low = grid.origin().array() - 1,
             high = grid.origin() + grid.resolution() * grid.size().cast<double>() + Vec3::Ones();
  std::size_t counts[4] = {};
  MapShare share;
  for (std::size_t i = 0; i < log.t_s.size(); ++i) {
    const Vec3 p_W = log::xyz(log, "", "_m", i);
    Fits place = Fits::outside;
    // An index of a place that is far away, or not finite, is none.
    if ((p_W.array() > low.array()).all() && (p_W.array() < high.array()).all()) {
      place = at_height(grid, p_W, reach, tolerance);
      for (const double dz : {tolerance, -tolerance})
        if (place != Fits::good && at_height(grid, p_W + Vec3(0, 0, dz), reach, tolerance) == Fits::good)
          place = Fits::good;
    }
    ++counts[static_cast<std::size_t>(place)];
    if (place != Fits::good && !share.first) share.first = {log.t_s[i], p_W};
  }
  const double n = std::max<double>(1, static_cast<double>(log.t_s.size()));
  share.inside = static_cast<double>(counts[1]) / n;
  share.too_near = static_cast<double>(counts[2]) / n;
  share.outside = static_cast<double>(counts[3]) / n;
  return share;
}

std::string to_text(const MapShare& share) {
  return formatted("%.1f %% inside of something, %.1f %% too near for its body, %.1f %% outside of the map",
                   100 * share.inside, 100 * share.too_near, 100 * share.outside);
}

}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "core/report/page/figure_parts.hpp"
#include "core/report/page/figures.hpp"

namespace backwash::report {
namespace {

const char* const kFlown = "linewidth 2 linecolor '#0b3d91'";
const char* const kCommanded = "linewidth 1.5 dashtype 2 linecolor '#d1495b'";

/// The voxel height of the first cell that is not free below (direction −1) or above (+1) a point, m.
double first_obstacle(const map::OccupancyGrid& grid, const Vec3& p, int direction) {
  Index3 v = grid.index(p);
  while (grid.free(v)) v.z() += direction;
  return grid.center(v).z() - direction * grid.resolution() / 2;
}

}  // namespace

std::vector<Vec3> octagon(const PerDirection& h) {
  std::vector<Vec3> corners = {{h[kX], -h[kY], 0}, {h[kX], h[kY], 0}, {-h[kX], h[kY], 0}, {-h[kX], -h[kY], 0}};
  for (const auto& [d, sign] : {std::pair{kXyPlus, 1.0}, {kXyPlus, -1.0}, {kXyMinus, 1.0}, {kXyMinus, -1.0}}) {
    const Vec3 n = sign * unit(d);
    std::vector<Vec3> kept;
    for (std::size_t i = 0; i < corners.size(); ++i) {  // Sutherland and Hodgman's clip at n·e = h
      const Vec3 &from = corners[i], &to = corners[(i + 1) % corners.size()];
      const double a = n.dot(from) - h[d], b = n.dot(to) - h[d];
      if (a <= 0) kept.push_back(from);
      if ((a < 0 && b > 0) || (a > 0 && b < 0)) kept.push_back(from + a / (a - b) * (to - from));
    }
    corners = std::move(kept);
  }
  return corners;
}

Figure map_figure(const sim::Flight& flight, const plan::World& world) {
  const auto& tube = flight.route.accepted.tube;
  const auto& vehicle = world.reach.vehicle;
  const double reserve = vehicle.body.radius + vehicle.estimation.position;
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  std::vector<Prism> sets;
  for (const auto& step : tube) {
    const auto& h = step.half_widths_interval;
    sets.push_back({step.center.p_W, h});
    const Vec3 extent = Vec3(h[kX], h[kY], h[kZ]) + Vec3::Constant(reserve);
    low = low.cwiseMin(step.center.p_W - extent);
    high = high.cwiseMax(step.center.p_W + extent);
  }
  const auto& grid = world.grid;
  const Vec3 around(2, 2, 0);
  const Index3 first = grid.index(low - around).cwiseMax(0),
               last = grid.index(high + around).cwiseMin(grid.size() - Index3::Ones());
  std::ostringstream script;
  script << cell_blocks(grid, first, last, low.z(), high.z()) << outlines("tube", sets, 0)
         << outlines("body", sets, reserve) << "$path << EOD\n";
  for (const auto& s : flight.route.samples) {
    script << s.truth.p_W.x() << ' ' << s.truth.p_W.y() << ' ' << s.command.p_W.x() << ' ' << s.command.p_W.y() << '\n';
  }
  const Vec3 begin = flight.route.samples.front().command.p_W, end = flight.route.samples.back().command.p_W;
  script << "EOD\n"
         << kAxes << view_from_above(grid, first, last) << "set key outside top center horizontal\n"
         << "set label 1 'start' at " << begin.x() << ',' << begin.y()
         << " point pointtype 7 pointsize 0.7 linecolor '#0b3d91' offset 0.8,0.6 front\n"
         << "set label 2 'goal' at " << end.x() << ',' << end.y()
         << " point pointtype 7 pointsize 0.7 linecolor '#0b3d91' offset 0.8,0.6 front\n"
         << "plot " << plot_cells() << plot_band("body", "#e3eef9", "#9dbfe0", "tube with the body around it")
         << plot_band("tube", "#9cc6ec", "#4a8fce", "reachable tube") << "$path using 3:4 with lines " << kCommanded
         << " title 'commands', $path using 1:2 with lines " << kFlown << " title 'flown'\n";
  const double ratio = (last - first).y() / std::max(1.0, static_cast<double>((last - first).x()));
  return draw(script.str(), Format::svg, 1000, std::clamp(static_cast<int>(900 * ratio) + 130, 300, 1200));
}

Figure height_figure(const sim::Flight& flight, const plan::World& world) {
  std::ostringstream script;
  script << "$heights << EOD\n";
  double way = 0, top = 0;
  for (std::size_t k = 0; k < flight.route.samples.size(); ++k) {
    const auto& s = flight.route.samples[k];
    if (k > 0) way += (s.command.p_W - flight.route.samples[k - 1].command.p_W).head<2>().norm();
    const auto& step = flight.route.accepted.tube[k];
    const double h = step.half_widths_interval[kZ], z = step.center.p_W.z();
    top = std::max(top, z + h + 0.6);
    script << way << ' ' << first_obstacle(world.grid, s.command.p_W, -1) << ' '
           << first_obstacle(world.grid, s.command.p_W, 1) << ' ' << z - h << ' ' << z + h << ' ' << s.command.p_W.z()
           << ' ' << s.truth.p_W.z() << '\n';
  }
  script << "EOD\n"
         << kAxes
         << "set xlabel 'way along the commands seen from above, m'\nset ylabel 'z, m'\nset key outside top center "
            "horizontal\n"
         << "stats $heights using 2 nooutput\nfloor = STATS_min - 0.15\nceiling = " << top
         << "\nset yrange [floor:ceiling]\n"
         << "plot $heights using 1:(floor):2 with filledcurves linecolor '#3c3c42' title 'floor or obstacle', "
         << "$heights using 1:3:(ceiling > $3 ? ceiling : $3) with filledcurves linecolor '#3c3c42' notitle, "
         << "$heights using 1:4:5 with filledcurves linecolor '#9cc6ec' title 'reachable tube', $heights using 1:6 "
            "with lines "
         << kCommanded << " title 'commands', $heights using 1:7 with lines " << kFlown << " title 'flown'\n";
  return draw(script.str(), Format::svg, 1000, 320);
}

}  // namespace backwash::report

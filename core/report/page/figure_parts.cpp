// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/page/figure_parts.hpp"

#include <algorithm>
#include <limits>
#include <sstream>

namespace backwash::report {
namespace {

map::Cell column(const map::OccupancyGrid& grid, int i, int j, int k_low, int k_high) {
  auto seen = map::Cell::free;
  for (int k = k_low; k <= k_high; ++k) {
    const auto cell = grid.at({i, j, k});
    if (cell == map::Cell::occupied) return cell;
    if (cell == map::Cell::unknown) seen = cell;
  }
  return seen;
}

}  // namespace

std::string cell_blocks(const map::OccupancyGrid& grid, const Index3& first, const Index3& last, double z_low,
                        double z_high) {
  const int k_low = grid.index({0, 0, z_low}).z(), k_high = grid.index({0, 0, z_high}).z();
  std::ostringstream blocks[2];
  for (int j = first.y(); j <= last.y(); ++j) {
    for (int i = first.x(); i <= last.x();) {
      const auto cell = column(grid, i, j, k_low, k_high);
      const int begin = i;
      while (i <= last.x() && column(grid, i, j, k_low, k_high) == cell) ++i;
      if (cell == map::Cell::free) continue;
      const double a = grid.resolution();
      const Vec3 low = grid.center({begin, j, 0}) - Vec3::Constant(a / 2),
                 high = grid.center({i - 1, j, 0}) + Vec3::Constant(a / 2);
      blocks[cell == map::Cell::occupied ? 0 : 1] << low.x() << ' ' << low.y() << ' ' << low.x() << ' ' << high.x()
                                                  << ' ' << low.y() << ' ' << high.y() << '\n';
    }
  }
  // gnuplot refuses empty blocks: a rectangle without extent stands in.
  const std::string nothing = "0 0 0 0 0 0\n";
  const auto text = [&](int n) { return blocks[n].str().empty() ? nothing : blocks[n].str(); };
  return "$occupied << EOD\n" + text(0) + "EOD\n$unknown << EOD\n" + text(1) + "EOD\n";
}

std::string view_from_above(const map::OccupancyGrid& grid, const Index3& first, const Index3& last) {
  const Vec3 half = Vec3::Constant(grid.resolution() / 2), low = grid.center(first) - half,
             high = grid.center(last) + half;
  std::ostringstream text;
  text << "set xrange [" << low.x() << ':' << high.x() << "]\nset yrange [" << low.y() << ':' << high.y()
       << "]\nset size ratio -1\nset xlabel 'x, m'\nset ylabel 'y, m'\n";
  return text.str();
}

std::string outlines(const std::string& name, std::span<const Prism> tube, double radius) {
  std::ostringstream text;
  text << '$' << name << " << EOD\n";
  Vec3 drawn = Vec3::Constant(std::numeric_limits<double>::infinity());
  for (std::size_t k = 0; k < tube.size(); ++k) {
    if ((tube[k].center_W - drawn).norm() < 0.01 && k + 1 < tube.size()) continue;  // 1 cm apart is dense enough
    drawn = tube[k].center_W;
    PerDirection h = tube[k].half_widths;
    for (double& value : h) value += radius;
    auto corners = octagon(h);
    corners.push_back(corners.front());
    for (const auto& corner : corners) text << drawn.x() + corner.x() << ' ' << drawn.y() + corner.y() << '\n';
    text << '\n';
  }
  text << "EOD\n";
  return text.str();
}

std::string plot_band(const std::string& name, const std::string& fill, const std::string& border,
                      const std::string& title) {
  return "$" + name + " with lines linewidth 2 linecolor '" + border + "' notitle, $" + name +
         " with filledcurves closed fillstyle solid noborder linecolor '" + fill + "' title '" + title + "', ";
}

std::string plot_cells() {
  return "$unknown with boxxyerror fillstyle solid noborder linecolor '#d5d5d5' title 'unknown', "
         "$occupied with boxxyerror fillstyle solid noborder linecolor '#3c3c42' title 'occupied', ";
}

}  // namespace backwash::report

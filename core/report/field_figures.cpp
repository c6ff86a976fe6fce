// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "core/report/field_box.hpp"
#include "core/report/page/figure_parts.hpp"
#include "core/report/page/figures.hpp"

namespace backwash::report {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

std::string palette() {
  std::ostringstream text;
  for (const auto& stop : kFieldPalette)
    text << (text.str().empty() ? "set palette defined (" : ", ") << stop.share << " '" << stop.colour << '\'';
  return text.str() + ")\n";
}

/// A regular raster of numbers over two axes of a map; NaN where there is nothing to show.
struct Raster {
  int horizontal, vertical;  ///< axes of the map
  Index3 low, size;          ///< in voxels
  std::vector<double> value;
};

Raster empty_raster(int axis, const Index3& low, const Index3& size) {
  Raster raster{axis == 0 ? 1 : 0, axis == 2 ? 1 : 2, low, size, {}};
  raster.value.assign(
      static_cast<std::size_t>(size[raster.horizontal]) * static_cast<std::size_t>(size[raster.vertical]), kNothing);
  return raster;
}

void set(Raster& raster, const Index3& v, double value) {
  const int i = v[raster.horizontal] - raster.low[raster.horizontal],
            j = v[raster.vertical] - raster.low[raster.vertical];
  if (i < 0 || j < 0 || i >= raster.size[raster.horizontal] || j >= raster.size[raster.vertical]) return;
  raster.value[static_cast<std::size_t>(j) * static_cast<std::size_t>(raster.size[raster.horizontal]) +
               static_cast<std::size_t>(i)] = value;
}

std::string block(const std::string& name, const Raster& raster, const map::OccupancyGrid& grid) {
  std::ostringstream text;
  text << '$' << name << " << EOD\n";
  const int width = raster.size[raster.horizontal];
  for (std::size_t n = 0; n < raster.value.size(); ++n) {
    Index3 v = raster.low;
    v[raster.horizontal] += static_cast<int>(n) % width;
    v[raster.vertical] += static_cast<int>(n) / width;
    const Vec3 p = grid.center(v);
    text << p[raster.horizontal] << ' ' << p[raster.vertical] << ' ';
    if (std::isnan(raster.value[n])) {
      text << "NaN\n";
    } else {
      text << raster.value[n] << '\n';
    }
  }
  text << "EOD\n";
  return text.str();
}

}  // namespace

Figure field_slice_figure(const map::OccupancyGrid& grid, const Slice& slice, const std::vector<FieldSample>& samples,
                          Format format) {
  const Raster blank = empty_raster(slice.axis, Index3::Zero(), grid.size());
  std::ostringstream script;
  double largest = 0;
  const char* const names[] = {"x", "y", "z"};
  for (int component = 0; component < 3; ++component) {
    Raster raster = blank;
    for (const auto& sample : samples) {
      const double deviation = std::sqrt(std::max(0.0, sample.sigma.along(Vec3::Unit(component))));
      largest = std::max(largest, deviation);
      set(raster, grid.index(sample.p_W), deviation);
    }
    script << block(names[component], raster, grid);
  }
  const double span_h = blank.size[blank.horizontal], span_v = blank.size[blank.vertical];
  const bool beside = span_v >= span_h;  // tall maps beside each other, wide ones below each other
  script << palette() << "set cbrange [0:" << (largest > 0 ? largest : 1)
         << "]\nset size ratio -1\nset tics out nomirror\n"
         << "set cblabel 'standard deviation, m/s^2'\nset border 3\nset object 1 rectangle from graph 0,0 to graph 1,1 "
            "behind fillcolor '#b9b9b9' fillstyle solid noborder\n"
         << "set xlabel '" << names[blank.horizontal] << ", m'\nset ylabel '" << names[blank.vertical] << ", m'\n"
         << "set xrange [" << grid.origin()[blank.horizontal] << ':'
         << grid.origin()[blank.horizontal] + grid.resolution() * span_h << "]\nset yrange ["
         << grid.origin()[blank.vertical] << ':' << grid.origin()[blank.vertical] + grid.resolution() * span_v << "]\n"
         << "set multiplot layout " << (beside ? "1,3" : "3,1") << " title 'disturbance at " << names[slice.axis]
         << " = " << slice.coordinate << " m (grey: not free)'\n";
  for (const char* name : names)
    script << "set title 'along " << name << "'\nplot $" << name << " using 1:2:3 with image notitle\n";
  script << "unset multiplot\n";
  const double panel = 900.0, ratio = span_v / span_h;
  const int width = beside ? 1400 : static_cast<int>(panel) + 180;
  const int height = beside ? std::clamp(static_cast<int>(300 * ratio) + 150, 300, 2400)
                            : std::clamp(static_cast<int>(3 * (panel * ratio + 110)), 400, 2700);
  return draw(script.str(), format, width, height);
}

Figure flight_field_figure(std::span<const Vec3> path_W, const plan::World& world) {
  const auto& grid = world.grid;
  const FieldView view = field_view(grid, path_W);
  const Index3 &first = view.low, &last = view.high;
  std::ostringstream path;
  for (const Vec3& p : path_W) path << p.x() << ' ' << p.y() << '\n';
  Raster raster = empty_raster(2, first, last - first + Index3::Ones());
  double largest = 0;
  for (int j = first.y(); j <= last.y(); ++j)
    for (int i = first.x(); i <= last.x(); ++i) {
      const Index3 v(i, j, view.layer);
      if (const double bound = world.bounds.at(v).w[kZ]; bound > 0) {
        largest = std::max(largest, bound);
        set(raster, v, bound);
      }
    }
  std::ostringstream script;
  script << block("field", raster, grid) << cell_blocks(grid, first, last, view.height_m, view.height_m)
         << "$path << EOD\n"
         << path.str() << "EOD\n"
         << palette() << "set cbrange [0:" << (largest > 0 ? largest : 1) << "]\nset tics out nomirror\nset border 3\n"
         << view_from_above(grid, first, last)
         << "set cblabel 'bound of the vertical disturbance, m/s^2'\nset key outside top center horizontal\n"
         << "plot $field using 1:2:3 with image notitle, " << plot_cells()
         << "$path using 1:2 with lines linewidth 2.5 linecolor '#0b3d91' title 'path flown'\n";
  const double ratio = (last - first).y() / std::max(1.0, static_cast<double>((last - first).x()));
  return draw(script.str(), Format::svg, 1000, std::clamp(static_cast<int>(820 * ratio) + 130, 300, 1100));
}

}  // namespace backwash::report

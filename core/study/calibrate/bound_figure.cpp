// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/calibrate/bound_figure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "core/field/disturbance_field.hpp"

namespace backwash::study::calibrate {
namespace {

struct Extent {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  double x = 0, hovers = 0;
};

Extent extent(const Data& data, std::size_t place) {
  Extent e;
  for (const auto& h : data.hovers) {
    if (data.place[h.flight] != place) continue;
    e.low = e.low.cwiseMin(h.p_W);
    e.high = e.high.cwiseMax(h.p_W);
    e.x += h.p_W.x();
    e.hovers += 1;
  }
  e.x /= std::max(1.0, e.hovers);
  return e;
}

std::string points(const Data& data, std::size_t place, int axis) {
  std::ostringstream text;
  for (const auto& h : data.hovers) {
    if (data.place[h.flight] != place) continue;
    for (const auto& v : h.ln_variance) text << h.p_W.y() << ' ' << h.p_W.z() << ' ' << std::exp(v[axis]) << '\n';
  }
  return text.str();
}

std::string surface(const Extent& e, const map::OccupancyGrid& grid, const Model& model, int axis) {
  constexpr double kStep = kCalibrationRules.figure_step;
  const field::ProximityField field(grid, model);
  std::ostringstream text;
  const int rows = static_cast<int>((e.high.z() - e.low.z()) / kStep) + 1,
            columns = static_cast<int>((e.high.y() - e.low.y()) / kStep) + 1;
  for (int k = 0; k <= rows; ++k) {
    for (int j = 0; j <= columns; ++j) {
      const Vec3 p(e.x, e.low.y() + (e.high.y() - e.low.y()) * j / columns,
                   e.low.z() + (e.high.z() - e.low.z()) * k / rows);
      text << p.y() << ' ' << p.z() << ' ' << field.at(p).sigma().along(Vec3::Unit(axis)) << '\n';
    }
    text << '\n';
  }
  return text.str();
}

}  // namespace

tl::expected<std::string, report::PlotError> bound_figure(const Data& data, const Model& model, int axis,
                                                          std::span<const FigurePlace> places) {
  std::ostringstream script, plots;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Extent e = extent(data, places[i].place);
    if (e.hovers == 0) continue;
    script << "$points" << i << " << EOD\n"
           << points(data, places[i].place, axis) << "EOD\n$surface" << i << " << EOD\n"
           << surface(e, *places[i].grid, model, axis) << "EOD\n";
    plots << "set title " << report::gnuplot_quoted(places[i].name) << " noenhanced\nsplot $surface" << i
          << " with pm3d notitle, $points" << i
          << " with points pointtype 7 pointsize 0.2 linecolor '#c0392b' notitle\n";
  }
  script << "set pm3d depthorder border linecolor '#506070' linewidth 0.3\nset palette defined (0 '#d6e6f4', 0.4 "
            "'#8fc3dd', 0.7 '#f6c667', 1 '#e8703a')\nset style fill transparent solid 0.6\nunset colorbox\n"
            "set xlabel 'y, m'\nset ylabel 'height, m'\nset zlabel 'variance, (m/s^2)^2' rotate parallel\n"
            "set logscale z\nset logscale cb\nset view 62, 305\nset xyplane 0\nset multiplot layout 1,"
         << std::max<std::size_t>(1, places.size()) << "\n"
         << plots.str() << "unset multiplot\n";
  return report::draw(script.str(), report::Format::svg,
                      480 * static_cast<int>(std::max<std::size_t>(1, places.size())), 460);
}

}  // namespace backwash::study::calibrate

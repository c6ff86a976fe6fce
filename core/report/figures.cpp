// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/figures.hpp"

#include <algorithm>
#include <cmath>

#include "core/report/flight_data.hpp"
#include "core/types/text.hpp"

namespace backwash::report {
namespace {

constexpr std::uint32_t kOccupied = 0x3c3c42ff, kUnknown = 0xd5d5d5ff, kFree = 0, kNotFree = 0xb9b9b9ff;

std::uint32_t column(const map::OccupancyGrid& grid, int i, int j, int k_low, int k_high) {
  auto seen = kFree;
  for (int k = k_low; k <= k_high; ++k) {
    const auto cell = grid.at({i, j, k});
    if (cell == map::Cell::occupied) return kOccupied;
    if (cell == map::Cell::unknown) seen = kUnknown;
  }
  return seen;
}

/// Pixels for the voxels from one to another, along two axes of the map.
Raster empty_raster(const map::OccupancyGrid& grid, const Index3& first, const Index3& last, int across, int up) {
  const Vec3 half = Vec3::Constant(grid.resolution() / 2), low = grid.center(first) - half,
             high = grid.center(last) + half;
  const Index3 size = last - first + Index3::Ones();
  return {{low[across], low[up]},
          {high[across], high[up]},
          static_cast<std::size_t>(size[across]),
          std::vector<std::uint32_t>(static_cast<std::size_t>(size[across]) * static_cast<std::size_t>(size[up]))};
}

/// A chart of a raster's extent, the metres of both axes as long.
Chart chart_over(Raster raster, const std::string& across, const std::string& up) {
  return {.x = {across, raster.low.x(), raster.high.x()},
          .y = {up, raster.low.y(), raster.high.y()},
          .rasters = {std::move(raster)},
          .equal = true};
}

/// The voxel height of the first cell that is not free below (direction −1) or above (+1) a point, m.
double first_obstacle(const map::OccupancyGrid& grid, const Vec3& p, int direction) {
  Index3 v = grid.index(p);
  while (grid.free(v)) v.z() += direction;
  return grid.center(v).z() - direction * grid.resolution() / 2;
}

/// What lies between two lines.
Layer between(Kind kind, const std::string& name, Run lower, const Run& upper) {
  lower.insert(lower.end(), upper.rbegin(), upper.rend());
  return {Shape::area, kind, name, {std::move(lower)}};
}

}  // namespace

Chart seen_from_above(const map::OccupancyGrid& grid, const Vec3& low_W, const Vec3& high_W, double z_low,
                      double z_high) {
  const Index3 first = nearest_voxel(grid, low_W), last = nearest_voxel(grid, high_W);
  const int k_low = grid.index({0, 0, z_low}).z(), k_high = grid.index({0, 0, z_high}).z();
  Raster cells = empty_raster(grid, first, last, 0, 1);
  cells.cells = true;
  auto pixel = cells.rgba.begin();
  for (int j = first.y(); j <= last.y(); ++j)
    for (int i = first.x(); i <= last.x(); ++i) *pixel++ = column(grid, i, j, k_low, k_high);
  Chart chart = chart_over(std::move(cells), "x, m", "y, m");
  chart.layers = {{Shape::area, Kind::unknown, "unknown", {}}, {Shape::area, Kind::occupied, "occupied", {}}};
  return chart;
}

Run run_of(std::span<const Vec3> path_W) {
  Run run;
  for (const Vec3& p : path_W) run.push_back(p.head<2>());
  return run;
}

Layer outlines(std::span<const Prism> tube, double radius, Kind kind, const std::string& name) {
  Layer layer{Shape::area, kind, name, {}};
  Vec3 drawn = Vec3::Constant(std::numeric_limits<double>::infinity());
  for (std::size_t k = 0; k < tube.size(); ++k) {
    if ((tube[k].center_W - drawn).norm() < 0.01 && k + 1 < tube.size()) continue;  // 1 cm apart is dense enough
    drawn = tube[k].center_W;
    PerDirection h = tube[k].half_widths;
    for (double& value : h) value += radius;
    auto corners = octagon(h);
    for (Vec3& corner : corners) corner += drawn;
    layer.runs.push_back(run_of(corners));
  }
  return layer;
}

std::vector<Chart> field_slice(const map::OccupancyGrid& grid, const Slice& slice,
                               const std::vector<FieldSample>& samples) {
  const int across = slice.axis == 0 ? 1 : 0, up = slice.axis == 2 ? 1 : 2;
  const auto deviation = [](const FieldSample& sample, int component) {
    return std::sqrt(std::max(0.0, sample.sigma.along(Vec3::Unit(component))));
  };
  double largest = 0;
  for (const auto& sample : samples)
    for (int component = 0; component < 3; ++component) largest = std::max(largest, deviation(sample, component));
  if (!(largest > 0)) largest = 1;
  const auto name = [](int axis) { return std::string(1, "xyz"[axis]); };
  std::vector<Chart> charts;
  for (int component = 0; component < 3; ++component) {
    Raster raster = empty_raster(grid, Index3::Zero(), grid.size() - Index3::Ones(), across, up);
    std::ranges::fill(raster.rgba, kNotFree);
    for (const auto& sample : samples) {
      const Index3 v = grid.index(sample.p_W);
      raster.rgba[static_cast<std::size_t>(v[up]) * raster.width + static_cast<std::size_t>(v[across])] =
          palette_colour(deviation(sample, component) / largest);
    }
    charts.push_back(chart_over(std::move(raster),
                                name(across) + ", m: disturbance along " + name(component) + " at " + name(slice.axis) +
                                    " = " + to_text(slice.coordinate, 2) + " m (grey: not free)",
                                name(up) + ", m"));
    charts.back().scale_to = largest;
    charts.back().scale_name = "standard deviation, m/s²";
  }
  return charts;
}

Chart map_chart(const sim::Flight& flight, const plan::World& world) {
  const auto& vehicle = world.reach.vehicle;
  const double reserve = vehicle.body.radius + vehicle.estimation.position;
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  std::vector<Prism> sets;
  for (const auto& step : flight.route.accepted.tube) {
    const auto& h = step.half_widths_interval;
    sets.push_back({step.center.p_W, h});
    const Vec3 extent = Vec3(h[kX], h[kY], h[kZ]) + Vec3::Constant(reserve);
    low = low.cwiseMin(step.center.p_W - extent);
    high = high.cwiseMax(step.center.p_W + extent);
  }
  std::vector<Vec3> commands;
  for (const auto& s : flight.route.samples) commands.push_back(s.command.p_W);
  const Vec3 around(2, 2, 0);
  Chart chart = seen_from_above(world.grid, low - around, high + around, low.z(), high.z());
  chart.layers.push_back(outlines(sets, reserve, Kind::body, "tube with the body around it"));
  chart.layers.push_back(outlines(sets, 0, Kind::tube, "reachable tube"));
  chart.layers.push_back({Shape::line, Kind::commanded, "commands", {run_of(commands)}});
  chart.layers.push_back({Shape::line, Kind::flown, "flown", {run_of(route_of(flight))}});
  chart.marks = {{commands.front().head<2>(), "start"}, {commands.back().head<2>(), "goal"}};
  return chart;
}

Chart height_chart(const sim::Flight& flight, const plan::World& world) {
  Run floor, ceiling, low, high, commands, flown;
  double way = 0, bottom = std::numeric_limits<double>::infinity(), top = 0;
  for (std::size_t k = 0; k < flight.route.samples.size(); ++k) {
    const auto& s = flight.route.samples[k];
    if (k > 0) way += (s.command.p_W - flight.route.samples[k - 1].command.p_W).head<2>().norm();
    const auto& step = flight.route.accepted.tube[k];
    const double h = step.half_widths_interval[kZ], z = step.center.p_W.z();
    floor.push_back({way, first_obstacle(world.grid, s.command.p_W, -1)});
    ceiling.push_back({way, first_obstacle(world.grid, s.command.p_W, 1)});
    low.push_back({way, z - h});
    high.push_back({way, z + h});
    commands.push_back({way, s.command.p_W.z()});
    flown.push_back({way, s.truth.p_W.z()});
    bottom = std::min(bottom, floor.back().y() - 0.15);
    top = std::max(top, z + h + 0.6);
  }
  for (Place& p : ceiling) p.y() = std::min(p.y(), top);
  return {.x = {"way along the commands seen from above, m", 0, way},
          .y = {"z, m", bottom, top},
          .layers = {between(Kind::occupied, "floor or obstacle", {{0, bottom}, {way, bottom}}, floor),
                     between(Kind::occupied, "", ceiling, {{0, top}, {way, top}}),
                     between(Kind::tube, "reachable tube", low, high),
                     {Shape::line, Kind::commanded, "commands", {commands}},
                     {Shape::line, Kind::flown, "flown", {flown}}},
          .height = 320};
}

Chart flight_field_chart(std::span<const Vec3> path_W, const plan::World& world) {
  const FieldView view = field_view(world.grid, path_W);
  Raster field = empty_raster(world.grid, view.low, view.high, 0, 1);
  std::vector<double> bounds;
  for (int j = view.low.y(); j <= view.high.y(); ++j)
    for (int i = view.low.x(); i <= view.high.x(); ++i)
      bounds.push_back(world.bounds.at(Index3(i, j, view.layer)).w[kZ]);
  const double found = std::ranges::max(bounds), largest = found > 0 ? found : 1;
  for (std::size_t n = 0; n < bounds.size(); ++n)
    if (bounds[n] > 0) field.rgba[n] = palette_colour(bounds[n] / largest);
  Chart chart = seen_from_above(world.grid, world.grid.center(view.low), world.grid.center(view.high), view.height_m,
                                view.height_m);
  chart.rasters.insert(chart.rasters.begin(), std::move(field));
  chart.scale_to = largest;
  chart.scale_name = "bound of the vertical disturbance, m/s²";
  chart.layers.push_back({Shape::line, Kind::flown, "path flown", {run_of(path_W)}});
  return chart;
}

}  // namespace backwash::report

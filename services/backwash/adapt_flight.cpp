// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/adapt_flight.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/adapt/disturbance.hpp"
#include "core/field/disturbance_field.hpp"
#include "core/log/log_columns.hpp"
#include "core/log/raw_flight.hpp"
#include "core/report/recorded_flight.hpp"
#include "core/study/windows/gates.hpp"
#include "core/study/windows/texture.hpp"
#include "services/backwash/study_flights.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

/// Adds the acceleration, by differences of the velocity.
void differentiate(log::FlightLog& log) {
  for (const char axis : {'x', 'y', 'z'}) {
    const auto& v = log.column(std::string("v") + axis + "_mps");
    std::vector<double> a(v.size());
    for (std::size_t k = 1; k < v.size(); ++k) a[k] = (v[k] - v[k - 1]) / (log.t_s[k] - log.t_s[k - 1]);
    log.columns[std::string("a") + axis + "_mps2"] = a;
  }
}

log::FlightLog read(const std::string& path, bool& accelerometer) {
  auto log = read_flight(path);
  for (const std::string prefix : {"", "v", "cmd_"}) {
    const std::string unit = prefix == "v" ? "_mps" : "_m";
    if (!log::has_xyz(log, prefix, unit))
      throw Failure(kBadData, path + ":1: no columns '" + prefix + "x" + unit + "' to '" + prefix + "z" + unit +
                                  "'; positions, velocities and set-points are needed");
  }
  for (std::size_t k = 1; k < log.t_s.size(); ++k)
    if (!(log.t_s[k] > log.t_s[k - 1]))
      throw Failure(kBadData, path + ":" + std::to_string(k + 2) + ": t_s does not rise; sort the rows by time");
  if (log.t_s.size() < 2) throw Failure(kBadData, path + ":1: fewer than two rows");
  accelerometer = log::has_xyz(log, "a", "_mps2");
  if (!accelerometer) differentiate(log);
  return log;
}

/// Rows of windows that calibration and study leave out too.
std::vector<char> gated_rows(const log::FlightLog& log, const Vehicle& vehicle) {
  const study::WindowOptions options;
  std::vector<std::size_t> rows(log.t_s.size());
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  const study::LogGates gates(log, rows, vehicle, options);
  std::vector<char> gated(rows.size());
  for (std::size_t begin = 0, end = 0; begin < rows.size(); begin = end) {
    while (end < rows.size() && log.t_s[end] < log.t_s[begin] + options.length_s) ++end;
    if (gates({begin, end}))
      std::fill(gated.begin() + static_cast<long>(begin), gated.begin() + static_cast<long>(end), 1);
  }
  return gated;
}

/// Σ along the axes and the class of its largest term at each place; nothing where the map has no free space.
struct Place {
  Vec3 sigma = Vec3::Zero();
  AirClass air = AirClass::none;
};
std::vector<Place> places_of(const std::vector<Vec3>& path, const field::ProximityField& field) {
  std::vector<Place> places(path.size());
  run_shown(path.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      if (!field.grid().free(field.grid().index(path[k]))) continue;
      const auto parts = field.at(path[k]);
      const auto sigma = parts.sigma();
      places[k] = {{sigma.xx, sigma.yy, sigma.zz}, dominant(parts.base, parts.ground, parts.wall, parts.corner)};
    }
  });
  return places;
}

/// Variance of the sensor per sample: the part that neighbouring samples of a window do not share. Of differentiated
/// velocities half the mean square of their steps, which is more than their noise.
Vec3 noise_of(const std::vector<adapt::AirSample>& samples, bool accelerometer) {
  std::vector<study::Residual> windows;
  Vec3 steps = Vec3::Zero();
  double seconds = 0, count = 0;
  for (std::size_t k = 1; k < samples.size(); ++k) {
    const double dt = samples[k].t_s - samples[k - 1].t_s;
    if (dt > adapt::Disturbance::kGap) continue;
    steps += (samples[k].w_W - samples[k - 1].w_W).cwiseAbs2(), seconds += dt, count += 1;
  }
  if (!(count > 0)) return Vec3::Zero();
  if (!accelerometer) return steps / (2 * count);
  const auto length = static_cast<std::size_t>(std::lround(study::kWindowRules.window_length * count / seconds));
  for (std::size_t begin = 0; begin + length <= samples.size(); begin += length) {
    study::Residual window{{}, samples[begin + length / 2].sigma};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double mean = 0;
      for (std::size_t k = begin; k < begin + length; ++k)
        mean += samples[k].w_W[static_cast<long>(axis)] / static_cast<double>(length);
      for (std::size_t k = begin; k < begin + length; ++k)
        window.x[axis].push_back(samples[k].w_W[static_cast<long>(axis)] - mean);
    }
    windows.push_back(std::move(window));
  }
  return windows.empty() ? Vec3(steps / (2 * count)) : study::texture_of(windows, count / seconds).white;
}

/// The floor z = 0 below a path and free space above it, where there is no map.
map::OccupancyGrid floor_below(const std::vector<Vec3>& path) {
  constexpr double kEdge = 0.1, kBeside = 2.5, kMost = 60;
  Vec3 low = path.front(), high = path.front();
  for (const Vec3& p : path) low = low.cwiseMin(p), high = high.cwiseMax(p);
  low.head<2>().array() -= kBeside, high.array() += kBeside, low.z() = -kEdge;
  const Index3 size = ((high - low).cwiseMin(kMost) / kEdge).array().ceil().cast<int>();
  map::OccupancyGrid grid(low, kEdge, size, map::Cell::free);
  for (int i = 0; i < size.x(); ++i)
    for (int j = 0; j < size.y(); ++j) grid.set({i, j, 0}, map::Cell::occupied);
  return grid;
}

/// The map that a raw log says it was flown with; nothing for other logs.
std::optional<map::OccupancyGrid> own_map(const std::string& path) {
  if (!log::is_raw_log(path)) return std::nullopt;
  const auto raw = log::read_raw_log(path);
  auto grid = raw ? report::recorded_map(raw->records) : tl::make_unexpected(raw.error());
  return grid ? std::optional(std::move(*grid)) : std::nullopt;
}

}  // namespace

FlownAir read_air(const std::string& path, const Vehicle& vehicle, const Model& model, const map::OccupancyGrid* grid) {
  FlownAir air;
  const auto log = read(path, air.accelerometer);
  air.attitude = log.has("qw") && log.has("qx") && log.has("qy") && log.has("qz");
  std::vector<Vec3> flown;
  for (std::size_t k = 0; k < log.t_s.size(); ++k) flown.push_back(log::xyz(log, "", "_m", k));
  auto floor = grid ? std::nullopt : own_map(path);
  if (!grid && !floor) floor = floor_below(flown);
  const auto places = places_of(flown, field::ProximityField(grid ? *grid : *floor, model));
  const auto gated = gated_rows(log, vehicle);
  const bool v = log::has_xyz(log, "cmd_v", "_mps"), a = log::has_xyz(log, "cmd_a", "_mps2");
  adapt::Disturbance disturbance(vehicle);
  for (std::size_t k = 0; k < log.t_s.size(); ++k) {
    const Setpoint command{log::xyz(log, "cmd_", "_m", k), v ? log::xyz(log, "cmd_v", "_mps", k) : Vec3::Zero(),
                           a ? log::xyz(log, "cmd_a", "_mps2", k) : Vec3::Zero(), 0};
    const auto w =
        gated[k]
            ? std::nullopt
            : disturbance.add(
                  {log.t_s[k], {flown[k], log::xyz(log, "v", "_mps", k)}, log::xyz(log, "a", "_mps2", k), command});
    if (!w || !(places[k].sigma.minCoeff() > 0)) {
      ++air.left_out;
      continue;
    }
    air.samples.push_back({log.t_s[k], *w, places[k].sigma, air.attitude ? places[k].air : AirClass::none});
  }
  air.noise = noise_of(air.samples, air.accelerometer);
  return air;
}

}  // namespace backwash::services

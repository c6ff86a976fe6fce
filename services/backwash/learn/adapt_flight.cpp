// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/adapt_flight.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/field/disturbance_field.hpp"
#include "core/log/columns/log_columns.hpp"
#include "core/log/raw/raw_flight.hpp"
#include "core/report/recorded_map.hpp"
#include "core/study/windows/gates/gates.hpp"
#include "services/backwash/learn/study_flights.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

log::FlightLog read(const std::string& path) {
  LogNotes notes{"backwash adapt", {}, {}, {}};
  auto log = read_told(path, notes);
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
  return log;
}

/// Rows of windows that calibration and study leave out too.
std::vector<char> gated_rows(const log::FlightLog& log, const Vehicle& vehicle) {
  std::vector<std::size_t> rows(log.t_s.size());
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  const study::LogGates gates(log, rows, vehicle);
  std::vector<char> gated(rows.size());
  for (std::size_t begin = 0, end = 0; begin < rows.size(); begin = end) {
    while (end < rows.size() && log.t_s[end] < log.t_s[begin] + study::kWindowRules.window_length) ++end;
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

/// The floor z = 0 below a path and free space above it, where there is no map.
map::OccupancyGrid floor_below(const std::vector<Vec3>& path) {
  constexpr double kEdge = 0.1, kBeside = 2.5, kMost = 60;
  Vec3 low = path.front(), high = path.front();
  for (const Vec3& p : path) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  low.head<2>().array() -= kBeside;
  high.array() += kBeside;
  low.z() = -kEdge;
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

/// What a tick at `t` sends, `row` being the last one at or before it: the mean of what is held over the tick; between
/// rows that are farther apart than ticks, what lies on the line from one to the next.
Setpoint command_at(const log::FlightLog& log, double t, std::size_t row) {
  constexpr double kNearly = 0.99, kParts = 4;
  const bool v = log::has_xyz(log, "cmd_v", "_mps"), a = log::has_xyz(log, "cmd_a", "_mps2");
  Setpoint mean;
  const auto add = [&](std::size_t k, double share) {
    mean.p_W += share * log::xyz(log, "cmd_", "_m", k);
    if (v) mean.v_W += share * log::xyz(log, "cmd_v", "_mps", k);
    if (a) mean.a_W += share * log::xyz(log, "cmd_a", "_mps2", k);
  };
  const double interval = log.t_s[row + 1] - log.t_s[row], on = (t - log.t_s[row]) / interval;
  if (interval > kNearly * kControlPeriod) {
    add(row, 1 - on);
    add(row + 1, on);
    return mean;
  }
  for (double part = 0.5; part < kParts; ++part) {
    while (row + 1 < log.t_s.size() && log.t_s[row + 1] <= t + part / kParts * kControlPeriod) ++row;
    add(row, 1 / kParts);
  }
  return mean;
}

}  // namespace

FlownAir read_air(const std::string& path, const Vehicle& vehicle, const Model& model, const map::OccupancyGrid* grid) {
  FlownAir air;
  const auto log = read(path);
  air.accelerometer = log::has_xyz(log, "a", "_mps2");
  air.attitude = log.has("qw") && log.has("qx") && log.has("qy") && log.has("qz");
  std::vector<Vec3> flown;
  for (std::size_t k = 0; k < log.t_s.size(); ++k) flown.push_back(log::xyz(log, "", "_m", k));
  auto floor = grid ? std::nullopt : own_map(path);
  if (!grid && !floor) floor = floor_below(flown);
  const auto places = places_of(flown, field::ProximityField(grid ? *grid : *floor, model));
  const auto gated = gated_rows(log, vehicle);
  constexpr double kSame = 1e-6, kGap = 0.5;  // s
  std::size_t row = 0;
  std::optional<std::size_t> used;
  air.left_out = static_cast<std::size_t>(std::ranges::count(gated, 1));
  air.rows = log.t_s.size() - air.left_out;
  for (std::int64_t k = 0;; ++k) {
    const double t = log.t_s.front() + static_cast<double>(k) * kControlPeriod;
    while (row + 1 < log.t_s.size() && log.t_s[row + 1] <= t + kSame) ++row;
    if (row + 1 == log.t_s.size()) return air;
    if (gated[row] || t - log.t_s[row] > kGap) continue;
    adapt::AirTick tick;
    tick.now_ns = std::llround(t * 1e9);
    if (used != row) tick.age_s = std::max(0.0, t - log.t_s[row]);
    used = row;
    tick.state = {flown[row], log::xyz(log, "v", "_mps", row)};
    tick.command = command_at(log, t, row);
    tick.sigma = places[row].sigma;
    tick.air = air.attitude ? places[row].air : AirClass::none;
    air.ticks.push_back(tick);
  }
}

}  // namespace backwash::services

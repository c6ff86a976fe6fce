// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <set>

#include "core/log/columns/flight_log.hpp"
#include "services/maps/geometry.hpp"
#include "services/maps/scalars.hpp"

namespace backwash::maps {
namespace {

tl::unexpected<map::MapError> from(const log::LogError& error) {
  const bool missing = error.kind == log::LogError::Kind::not_found;
  return tl::make_unexpected(
      map::MapError{missing ? map::MapError::Kind::not_found : map::MapError::Kind::corrupt, error.message});
}

using Names = std::vector<std::string>;

/// The names by which a file has three axes, or none.
Names first_present(const Names& present, std::initializer_list<Names> spellings) {
  for (const auto& names : spellings)
    if (std::ranges::all_of(names, [&](const auto& n) { return std::ranges::count(present, n) == 1; })) return names;
  return {};
}

std::vector<Vec3> rows_of(const log::FlightLog& table, const Names& names) {
  const auto &x = table.column(names[0]), &y = table.column(names[1]), &z = table.column(names[2]);
  std::vector<Vec3> rows(x.size());
  for (std::size_t n = 0; n < rows.size(); ++n) rows[n] = {x[n], y[n], z[n]};
  return rows;
}

}  // namespace

Read read_point_csv(const std::string& path, std::string_view content) {
  const auto present = log::csv_names(path);
  if (!present) return from(present.error());
  const auto place = first_present(*present, {{"x_m", "y_m", "z_m"}, {"x", "y", "z"}, {"X", "Y", "Z"}});
  const auto sensor = first_present(*present, {{"sensor_x_m", "sensor_y_m", "sensor_z_m"}});
  if (place.empty()) return corrupt(path, ":1: no columns x_m,y_m,z_m; the first line should name them");
  std::set<std::string> unread(present->begin(), present->end());
  for (const auto* names : {&place, &sensor})
    for (const auto& name : *names) unread.erase(name);
  const auto table = log::read_csv(path, "", unread, true);
  if (!table) return from(table.error());
  if (table->column(place[0]).size() > kMostPoints) return too_large(path, table->column(place[0]).size());
  Geometry geometry;
  // Rows, but for the first line, by their ends; a row of nothing is none.
  for (take_line(content); !content.empty();)
    geometry.stated += take_line(content).find_first_not_of(" \t\r") != std::string_view::npos;
  geometry.taken = table->column(place[0]).size();
  geometry.points = rows_of(*table, place);
  if (!sensor.empty()) geometry.sensors = rows_of(*table, sensor);
  for (std::size_t n = 0; n < geometry.sensors.size(); ++n)
    if (!geometry.sensors[n].allFinite() && geometry.points[n].allFinite())
      return corrupt(path, ":" + std::to_string(n + 2) +
                               ": a point without the place of its sensor; leave out the three columns or the row");
  return geometry;
}

}  // namespace backwash::maps

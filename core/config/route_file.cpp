// SPDX-License-Identifier: BSD-3-Clause
#include "core/config/route_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "core/files/read_file.hpp"

namespace backwash::config {
namespace {

constexpr std::size_t kMostWaypoints = 64;  // of the IDL's sequence
constexpr const char* kPlaces = "x_m,y_m,z_m";
constexpr const char* kHeadings = "x_m,y_m,z_m,yaw_rad";

std::optional<Waypoint> waypoint(const std::string& line, bool facing) {
  Waypoint row;
  Vec3& p = row.p_W;
  int read = 0;
  if (std::sscanf(line.c_str(), "%lf,%lf,%lf %n", &p.x(), &p.y(), &p.z(), &read) != 3 || !p.allFinite())
    return std::nullopt;
  const char* rest = line.c_str() + read;
  if (!facing) return *rest == 0 ? std::optional(row) : std::nullopt;
  if (*rest++ != ',') return std::nullopt;
  if (*rest == 0) return row;
  char more;
  if (std::sscanf(rest, "%lf %c", &row.yaw.emplace(), &more) != 1 || !std::isfinite(*row.yaw)) return std::nullopt;
  return row;
}

}  // namespace

tl::expected<std::vector<Waypoint>, ConfigError> read_route(const std::string& path) {
  const auto fail = [&](const std::string& where, const std::string& why,
                        ConfigError::Kind kind = ConfigError::Kind::invalid) {
    return tl::make_unexpected(ConfigError{kind, path + where + ": " + why});
  };
  auto content = files::read_file(path, files::kLargestConfiguration, "a points CSV file");
  if (!content) return fail("", content.error().message, ConfigError::Kind::not_found);
  std::istringstream file(std::move(*content));
  std::string line;
  const auto next = [&] {
    const bool more = static_cast<bool>(std::getline(file, line));
    if (line.ends_with('\r')) line.pop_back();
    return more;
  };
  next();
  const bool facing = line == kHeadings;
  if (!facing && line != kPlaces)
    return fail(":1", "the first line is '" + line + "', expected " + kPlaces + " or " + kHeadings);
  std::vector<Waypoint> route;
  for (int number = 2; next(); ++number) {
    const auto row = waypoint(line, facing);
    if (!row)
      return fail(":" + std::to_string(number),
                  "'" + line + "' is not three numbers" + (facing ? " and a heading, which may be empty" : ""));
    route.push_back(*row);
  }
  const std::size_t most = has_headings(route) ? kMostWaypoints / 2 : kMostWaypoints;
  if (route.empty() || route.size() > most)
    return fail("", std::to_string(route.size()) + " points" + (has_headings(route) ? " with headings" : "") +
                        ", expected 1 to " + std::to_string(most));
  return route;
}

bool has_headings(const std::vector<Waypoint>& route) {
  return std::ranges::any_of(route, [](const Waypoint& w) { return w.yaw.has_value(); });
}

std::vector<Vec3> waypoints_of(const std::vector<Waypoint>& route) {
  const bool facing = has_headings(route);
  std::vector<Vec3> points;
  for (const auto& [p, yaw] : route) {
    points.push_back(p);
    if (facing) points.push_back(yaw ? Vec3(p + Vec3(std::cos(*yaw), std::sin(*yaw), 0)) : p);
  }
  return points;
}

}  // namespace backwash::config

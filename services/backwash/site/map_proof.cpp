// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "core/map/load_map.hpp"
#include "services/backwash/site/map_input.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

constexpr std::size_t kPlaces = 16;           // of a triangle
constexpr std::size_t kMostPlaces = 1 << 25;  // of all of them, some 3 s; each triangle has three

/// Place n on a triangle: its middle, its corners, then evenly in it (M. Roberts' sequence R2, folded).
Vec3 place_on(const Vec3& a, const Vec3& b, const Vec3& c, std::size_t n) {
  constexpr double kFirst = 0.7548776662466927, kSecond = 0.5698402909980532;  // 1/g, 1/g², g³ = g + 1
  if (n == 0) return (a + b + c) / 3;
  if (n <= 3) return n == 1 ? a : n == 2 ? b : c;
  double u = std::fmod(kFirst * static_cast<double>(n), 1), v = std::fmod(kSecond * static_cast<double>(n), 1);
  if (u + v > 1) u = 1 - u, v = 1 - v;
  return a + u * (b - a) + v * (c - a);
}

}  // namespace

std::string lost_in(const std::string& written, const MadeMap& made, const std::string& source) {
  const auto read = map::load_octomap(written);
  if (!read) return read.error().message;
  const Index3 first = read->index(made.grid.center(Index3::Zero()));
  for (std::size_t n = 0; n < made.grid.cell_count(); ++n)
    if (const Index3 v = made.grid.voxel(n); read->at(first + v) != made.grid.at(n))
      return "the voxel at " + to_text(made.grid.center(v)) + " is read back otherwise than it was made";
  const auto& [points, triangles] = std::tie(made.from.points, made.from.triangles);
  const std::size_t each = triangles.size() * kPlaces > kMostPlaces ? 3 : kPlaces;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t n = 0; n < each; ++n) {
      const Vec3 at = place_on(points[triangles[t][0]], points[triangles[t][1]], points[triangles[t][2]], n);
      if (!made.grid.inside(made.grid.index(at)) || read->occupied(read->index(at))) continue;
      const std::size_t line = t < made.from.lines.size() ? made.from.lines[t] : 0;
      return "lacks triangle " + std::to_string(t + 1) + " of " + source +
             (line > 0 ? ":" + std::to_string(line) : "") + " at " + to_text(at);
    }
  return "";
}

}  // namespace backwash::services

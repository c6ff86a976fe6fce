// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/load_map.hpp"
#include "services/backwash/site/map_input.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

/// Shares of a triangle's corners at `n` places along its sides and as many within; its corners are among them.
std::vector<Vec3> places_on_triangle(int n) {
  std::vector<Vec3> shares;
  for (int a = 0; a <= n; ++a)
    for (int b = 0; a + b <= n; ++b) shares.push_back(Vec3(a, b, n - a - b) / n);
  return shares;
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
  constexpr std::size_t kMany = 1 << 21;  // of them the corners alone, some seconds
  const auto shares = places_on_triangle(triangles.size() > kMany ? 1 : 5);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const Vec3& share : shares) {
      const auto& [a, b, c] = triangles[t];
      const Vec3 at = share[0] * points[a] + share[1] * points[b] + share[2] * points[c];
      if (!made.grid.inside(made.grid.index(at)) || read->occupied(read->index(at))) continue;
      const std::size_t line = t < made.from.lines.size() ? made.from.lines[t] : 0;
      return "lacks triangle " + std::to_string(t + 1) + " of " + source +
             (line > 0 ? ":" + std::to_string(line) : "") + " at " + to_text(at);
    }
  return "";
}

}  // namespace backwash::services

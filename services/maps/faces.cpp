// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <algorithm>

#include "services/maps/geometry.hpp"

namespace backwash::maps {
namespace {

using Corners = std::vector<std::array<double, 2>>;
using Triangles = std::vector<std::array<std::uint32_t, 3>>;
constexpr std::size_t kMostEars = 4096;  // corners; beyond that a fan does not take minutes

/// Twice the area of a triangle, positive where it turns left.
double turn(const Corners& at, std::size_t a, std::size_t b, std::size_t c) {
  return (at[b][0] - at[a][0]) * (at[c][1] - at[a][1]) - (at[b][1] - at[a][1]) * (at[c][0] - at[a][0]);
}

/// The corners in the plane of two axes that shows the face largest, turning left.
Corners flat(const std::vector<Vec3>& points, std::span<const std::uint32_t> face) {
  Vec3 normal = Vec3::Zero();
  for (std::size_t n = 2; n < face.size(); ++n)
    normal += (points[face[n - 1]] - points[face[0]]).cross(points[face[n]] - points[face[0]]);
  int up = 0;
  normal.cwiseAbs().maxCoeff(&up);
  const int first = (up + (normal[up] > 0 ? 1 : 2)) % 3, second = 3 - up - first;
  Corners at;
  for (const auto corner : face) at.push_back({points[corner][first], points[corner][second]});
  return at;
}

/// Triangles that all turn left, by numbers of corners; nothing where there are none. Each takes a corner off the ring,
/// so what they cover, counted by their turns, is the face: they cover it once.
Triangles ears(const Corners& at) {
  std::vector<std::uint32_t> ring(at.size());
  for (std::uint32_t n = 0; n < ring.size(); ++n) ring[n] = n;
  Triangles found;
  const auto is_ear = [&](std::size_t n) {
    const auto a = ring[(n + ring.size() - 1) % ring.size()], b = ring[n], c = ring[(n + 1) % ring.size()];
    if (turn(at, a, b, c) <= 0) return turn(at, a, b, c) == 0 && (at[a] == at[b] || at[b] == at[c]);
    for (const auto p : ring)
      if (at[p] != at[a] && at[p] != at[b] && at[p] != at[c] && turn(at, a, b, p) >= 0 && turn(at, b, c, p) >= 0 &&
          turn(at, c, a, p) >= 0)
        return false;
    return true;
  };
  for (std::size_t n = 0, missed = 0; ring.size() > 3 && missed <= ring.size(); ++n, ++missed) {
    n %= ring.size();
    if (!is_ear(n)) continue;
    found.push_back({ring[(n + ring.size() - 1) % ring.size()], ring[n], ring[(n + 1) % ring.size()]});
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(n));
    missed = 0;
  }
  if (ring.size() > 3 || turn(at, ring[0], ring[1], ring[2]) < 0) return {};
  found.push_back({ring[0], ring[1], ring[2]});
  return found;
}

}  // namespace

void add_face(Geometry& geometry, std::span<const std::uint32_t> corners, std::size_t line) {
  const auto corner = [&](std::size_t n) { return corners[std::min(n, corners.size() - 1)]; };
  Triangles parts;  // a fan
  for (std::uint32_t n = 2; n < std::max<std::size_t>(corners.size(), 3); ++n) parts.push_back({0, n - 1, n});
  if (corners.size() > 3) {
    const auto at = flat(geometry.points, corners);
    const bool once = std::ranges::all_of(parts, [&](const auto& t) { return turn(at, t[0], t[1], t[2]) >= 0; });
    auto cut = once || corners.size() > kMostEars ? Triangles() : ears(at);
    geometry.fans += !once && cut.empty();
    if (!cut.empty()) parts = std::move(cut);
  }
  for (const auto& t : parts) {
    geometry.triangles.push_back({corner(t[0]), corner(t[1]), corner(t[2])});
    geometry.lines.push_back(static_cast<std::uint32_t>(line));
  }
}

}  // namespace backwash::maps

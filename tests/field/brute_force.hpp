// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The oracle of tests/field: docs/model.md sections 1 and 2 written a second time as loops over everything. Shares only
// the plain types with core/field. A segment meets a box by the separating-axis test (core/field uses slabs).

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/types/model.hpp"

namespace backwash::oracle {

using map::Cell;
using map::OccupancyGrid;

struct Piece {
  bool up;
  Vec3 c, m;
  double A;
  std::optional<Vec3> k;
};

inline Cell cell(const OccupancyGrid& grid, int i, int j, int k) { return grid.at(Index3(i, j, k)); }

/// The closed box of every voxel that is occupied, as centres.
inline std::vector<Vec3> occupied_centers(const OccupancyGrid& grid) {
  std::vector<Vec3> centers;
  for (int i = 0; i < grid.size().x(); ++i)
    for (int j = 0; j < grid.size().y(); ++j)
      for (int k = 0; k < grid.size().z(); ++k)
        if (cell(grid, i, j, k) == Cell::occupied)
          centers.push_back(grid.origin() + grid.resolution() * Vec3(i + 0.5, j + 0.5, k + 0.5));
  return centers;
}

inline std::vector<Piece> pieces(const OccupancyGrid& grid) {
  const double a = grid.resolution();
  const int dx[] = {1, -1, 0, 0}, dy[] = {0, 0, 1, -1};
  std::vector<Piece> all;
  for (int k = 0; k < grid.size().z(); ++k)
    for (int j = 0; j < grid.size().y(); ++j)
      for (int i = 0; i < grid.size().x(); ++i) {
        if (cell(grid, i, j, k) != Cell::occupied) continue;
        const Vec3 center = grid.origin() + a * Vec3(i + 0.5, j + 0.5, k + 0.5);
        if (cell(grid, i, j, k + 1) == Cell::free)
          all.push_back({true, center + Vec3(0, 0, a / 2), Vec3(0, 0, 1), a * a, std::nullopt});

        std::vector<int> faces;
        for (int f = 0; f < 4; ++f)
          if (cell(grid, i + dx[f], j + dy[f], k) == Cell::free) faces.push_back(f);
        if (faces.empty()) continue;
        double gx = 0, gy = 0;
        for (int di = -2; di <= 2; ++di)
          for (int dj = -2; dj <= 2; ++dj)
            for (int dk = -1; dk <= 1; ++dk)
              if (cell(grid, i + di, j + dj, k + dk) != Cell::free) {
                gx -= di;
                gy -= dj;
              }
        const auto has = [&](int f) { return std::count(faces.begin(), faces.end(), f) > 0; };
        const double norm = std::sqrt(gx * gx + gy * gy);
        bool looks_out = false;
        for (const int f : faces) looks_out |= norm > 0 && (gx * dx[f] + gy * dy[f]) / norm > 1e-9;

        const auto add = [&](double mx, double my) {
          const Vec3 c = center + a / 2 * Vec3(mx, my, 0);
          int chosen = -1;
          double most = -2;
          for (const int f : faces)
            if (mx * dx[f] + my * dy[f] > most + 1e-9) {
              chosen = f;
              most = mx * dx[f] + my * dy[f];
            }
          int down = k;
          while (cell(grid, i + dx[chosen], j + dy[chosen], down) == Cell::free) --down;
          std::optional<Vec3> corner;
          if (cell(grid, i + dx[chosen], j + dy[chosen], down) == Cell::occupied)
            corner = Vec3(c.x(), c.y(), grid.origin().z() + a * (down + 1));
          all.push_back({false, c, Vec3(mx, my, 0), a * a / std::max(std::abs(mx), std::abs(my)), corner});
        };
        if ((has(0) && has(1)) || (has(2) && has(3)) || norm == 0 || !looks_out) {
          for (const int f : faces) add(dx[f], dy[f]);
        } else {
          add(gx / norm, gy / norm);
        }
      }
  return all;
}

/// Separating axes of a segment (midpoint, half vector) and a box (centre, equal half edges).
inline bool segment_meets_box(const Vec3& from, const Vec3& to, const Vec3& box_center, double half_edge) {
  const Vec3 h = (to - from) / 2, m = (from + to) / 2 - box_center;
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(m[axis]) > half_edge + std::abs(h[axis])) return false;
  const Vec3 cross = m.cross(h);
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (std::abs(cross[axis]) > half_edge * (std::abs(h[u]) + std::abs(h[v]))) return false;
  }
  return true;
}

inline bool sees(const std::vector<Vec3>& occupied, double a, const Vec3& p, const Vec3& c) {
  const double distance = (c - p).norm();
  if (distance <= 2 * a * (1 + 1e-7)) return true;
  const Vec3 end = p + (c - p) * ((distance - 2 * a) / distance);
  return std::none_of(occupied.begin(), occupied.end(),
                      [&](const Vec3& box) { return segment_meets_box(p, end, box, a * (0.5 + 1e-7)); });
}

struct Parts {
  Mat3 ground = Mat3::Zero(), corner = Mat3::Zero(), wall = Mat3::Zero();
};

inline Parts evaluate(const OccupancyGrid& grid, const std::vector<Piece>& all, const std::vector<Vec3>& occupied,
                      const Model& model, const Vec3& p) {
  constexpr double tol = 1e-9, half_pi = 1.57079632679489661923;
  const double a = grid.resolution();
  Parts sum;
  for (const Piece& e : all) {
    const Vec3 r = e.c - p;
    const double l = std::max(r.norm(), a / 2);
    const double theta = r.norm() == 0 ? 0 : std::acos(std::clamp(-r.z() / r.norm(), -1.0, 1.0));
    if (e.m.dot(p - e.c) <= tol) continue;
    Mat3 ground = Mat3::Zero(), corner = Mat3::Zero(), wall = Mat3::Zero();
    const Vec3 t = Vec3(0, 0, 1).cross(e.m);
    const auto tensor = [&](double n, double along, double z) -> Mat3 {
      return n * e.m * e.m.transpose() + along * t * t.transpose() + Vec3(0, 0, z).asDiagonal().toDenseMatrix();
    };
    if (e.up) {
      const auto& g = model.ground;
      const bool cone = theta <= g.theta_max + tol && l <= g.l_max + tol;
      const bool disc = l * std::sin(theta) <= g.r0 + tol && theta < half_pi && l <= g.l_footprint_max + tol;
      const auto s = [&](double lambda, double k1) { return e.A * (lambda / (l * l) + k1 * std::exp(-g.k2 * l * l)); };
      const double h = s(g.lambda.horizontal, g.k1.horizontal), z = s(g.lambda.vertical, g.k1.vertical);
      if (cone || disc) ground = Vec3(h, h, z).asDiagonal();
    } else {
      const auto& w = model.wall;
      if (theta >= w.theta_min - tol && theta <= half_pi + tol && l <= w.l_max + tol)
        wall = e.A * std::exp(-w.k2 * l * l) * tensor(w.k1.normal, w.k1.tangential, w.k1.vertical);
      const auto& co = model.corner;
      if (e.k && r.norm() <= w.l_max + tol) {
        const double d = std::hypot(p.x() - e.k->x(), p.y() - e.k->y()), h = p.z() - e.k->z();
        const double phi = std::atan2(d, h);
        if (phi <= co.phi_max && std::hypot(d, h) <= co.l_max + tol)
          corner = e.A * (co.phi_max - phi) / (d * d + std::pow(h, 6)) *
                   tensor(co.lambda.normal, co.lambda.tangential, co.lambda.vertical);
      }
    }
    if (ground.isZero(0) && corner.isZero(0) && wall.isZero(0)) continue;
    if (!sees(occupied, a, p, e.c)) continue;
    sum.ground += ground;
    sum.corner += corner;
    sum.wall += wall;
  }
  return sum;
}

inline Mat3 matrix(const Variance& v) {
  Mat3 m;
  m << v.xx, v.xy, v.xz, v.xy, v.yy, v.yz, v.xz, v.yz, v.zz;
  return m;
}

}  // namespace backwash::oracle

// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/extension.hpp"

#include <algorithm>
#include <cmath>

#include "core/map/lattice.hpp"

namespace backwash::field {
namespace {

using Kind = ModelEffect::Kind;
constexpr double kNearest = 0.15;     // m
constexpr double kNegligible = 2e-3;  // m/s²
constexpr double kFarthest = 3;       // m, what the study sees of walls

/// How far a wall's push is worth looking for, m.
double wall_range(const ModelEffect& e) {
  const double size = std::max(std::abs(e.value.x()) + e.error.x(), kNegligible);
  return std::clamp(kSurfaceReference + e.scale * std::log(size / kNegligible), kNearest, kFarthest);
}

}  // namespace

double near_surface(double distance, double reference, double length) noexcept {
  return std::isfinite(distance) ? std::exp(-(std::max(distance, kNearest) - reference) / length) : 0.0;
}

Air air_around(std::span<const ModelEffect> effects, const Around& around) {
  Air air;
  for (const ModelEffect& e : effects) {
    const double value = e.value.x(), error = e.error.x();
    if (e.kind == Kind::push_over_surface || e.kind == Kind::push_under_surface) {
      const double share = e.kind == Kind::push_over_surface
                               ? near_surface(around.height, kSurfaceReference, e.scale)
                               : near_surface(around.ceiling_gap, kCeilingReference, e.scale);
      air.push_W.z() += value * share;
      air.vertical += error * share;
    } else if (e.kind == Kind::push_to_walls) {
      const double range = wall_range(e);
      for (const auto& [distance, direction] : around.walls) {
        if (distance > range) continue;
        const double share = near_surface(distance, kSurfaceReference, e.scale);
        air.push_W += value * share * direction;
        air.level += error * share;
      }
    } else if (e.kind == Kind::ln_variance_under_surface) {
      air.ln_variance += (value + error) * near_surface(around.ceiling_gap, kCeilingReference, e.scale);
    }
  }
  return air;
}

Air air_moving(std::span<const ModelEffect> effects, const Vec3& v_W) noexcept {
  Air air;
  const double speed = v_W.norm(), level = std::hypot(v_W.x(), v_W.y());
  for (const ModelEffect& e : effects) {
    const double value = e.value.x(), error = e.error.x();
    if (e.kind == Kind::push) {
      air.push_W += e.value;
      air.level += std::hypot(e.error.x(), e.error.y());
      air.vertical += e.error.z();
    } else if (e.kind == Kind::push_against_velocity) {
      air.push_W -= value * Vec3(v_W.x(), v_W.y(), 0);
      air.level += error * level;
    } else if (e.kind == Kind::push_with_speed) {
      air.push_W.z() += value * speed * speed;
      air.vertical += error * speed * speed;
    } else if (e.kind == Kind::ln_variance) {
      air.ln_variance += value + error;
    } else if (e.kind == Kind::ln_variance_with_speed) {
      air.ln_variance += (value + error) * std::pow(speed, e.scale);
    }
  }
  return air;
}

Extension::Extension(const map::OccupancyGrid& grid, const Model& model)
    : effects_(model.extension), origin_W_(grid.origin()), resolution_(grid.resolution()), size_(grid.size()) {
  for (const ModelEffect& e : effects_) {
    if (e.kind == Kind::push_over_surface) sight_.down = 20;
    if (e.kind == Kind::push_under_surface || e.kind == Kind::ln_variance_under_surface) sight_.up = 20;
    if (e.kind == Kind::push_to_walls) sight_.level = std::max(sight_.level, wall_range(e));
  }
  if (sight_.down + sight_.up + sight_.level > 0) voxels_.resize(grid.cell_count());
}

void Extension::fill(const map::OccupancyGrid& grid, std::span<const std::size_t> voxels) {
  if (!by_place()) return;
  for (const std::size_t n : voxels) {
    const Air air = air_around(effects_, around(grid, grid.center(grid.voxel(n)), sight_));
    const Eigen::Vector3f push = air.push_W.cast<float>();
    voxels_[n] = {{push.x(), push.y(), push.z()},
                  static_cast<float>(air.level),
                  static_cast<float>(air.vertical),
                  static_cast<float>(air.ln_variance),
                  true};
  }
}

Air Extension::at(const Index3& v) const noexcept {
  if (!by_place() || !map::inside(size_, v)) return {};
  const Stored& s = voxels_[map::linear(size_, v)];
  if (!s.set) return {};
  return {Vec3(s.push[0], s.push[1], s.push[2]), s.level, s.vertical, s.ln_variance};
}

Vec3 Extension::push(const Vec3& p_W, const Vec3& v_W) const noexcept {
  if (none()) return Vec3::Zero();
  Vec3 sum = Vec3::Zero();
  if (by_place()) {
    const Vec3 q = (p_W - origin_W_) / resolution_ - Vec3::Constant(0.5);
    // Beyond one voxel around the grid nothing is stored; also keeps the conversion to int within its range.
    const bool near = (q.array() > -1).all() && (q.array() < size_.array().cast<double>()).all();
    double weight = 0;
    const auto add = [&](const Index3& v, const Vec3& share) {
      if (!map::inside(size_, v)) return;
      const Stored& s = voxels_[map::linear(size_, v)];
      if (!s.set) return;
      weight += share.prod();
      sum += share.prod() * Vec3(s.push[0], s.push[1], s.push[2]);
    };
    if (near) map::for_corners(q, add);
    if (weight > 0) sum /= weight;
  }
  return sum + moving(v_W).push_W;
}

}  // namespace backwash::field

// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/proximity_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace backwash::field {
namespace {

constexpr double kTolerance = 1e-9;  // of gates, m and rad

/// Cosine of an upper limit of θ ∈ [0, π], lowered by the tolerance; below −1 where the limit excludes nothing.
double cos_upper(double limit) {
  const double angle = limit + kTolerance;
  return angle >= std::numbers::pi ? -2 : angle < 0 ? 2 : std::cos(angle);
}
/// Cosine of a lower limit, raised by the tolerance.
double cos_lower(double limit) {
  const double angle = limit - kTolerance;
  return angle <= 0 ? 2 : angle > std::numbers::pi ? -2 : std::cos(angle);
}

}  // namespace

ProximityModel::ProximityModel(const Model& model, double voxel_edge) noexcept
    : model_(model),
      least_l_(0.5 * voxel_edge),
      corner_l2_max_((model.corner.l_max + kTolerance) * (model.corner.l_max + kTolerance)),
      tan_phi_max_(std::tan(model.corner.phi_max)),
      cos_ground_max_(cos_upper(model.ground.theta_max)),
      cos_wall_min_(cos_lower(model.wall.theta_min)),
      cos_level_(cos_upper(std::numbers::pi / 2)) {}

Variance ProximityModel::ground(const Element& element, const Vec3& p_W) const noexcept {
  if (element.kind != Element::Kind::up) return {};
  const auto& g = model_.ground;
  const Vec3 r = element.c_W - p_W;
  const double distance = r.norm(), l = std::max(distance, least_l_);
  const double cos_theta = distance > 0 ? -r.z() / distance : 1;
  const double sin_theta = distance > 0 ? r.head<2>().norm() / distance : 0;
  const bool in_cone = cos_theta >= cos_ground_max_ && l <= g.l_max + kTolerance;
  const bool in_footprint = l * sin_theta <= g.r0 + kTolerance && cos_theta > 0 && l <= g.l_footprint_max + kTolerance;
  if (!in_cone && !in_footprint) return {};
  const double inverse_square = 1 / (l * l), decay = std::exp(-g.k2 * l * l);
  return Variance::horizontal_vertical(element.area * (g.lambda.horizontal * inverse_square + g.k1.horizontal * decay),
                                       element.area * (g.lambda.vertical * inverse_square + g.k1.vertical * decay));
}

Variance ProximityModel::corner(const Element& element, const Vec3& p_W) const noexcept {
  if (!element.corner_W || !in_wall_range((element.c_W - p_W).squaredNorm())) return {};
  const Vec3 above = p_W - *element.corner_W;
  const double s = element.area * corner_factor(above.head<2>().squaredNorm(), above.z());
  const auto& lambda = model_.corner.lambda;
  return Variance::about_normal(element.normal, s * lambda.normal, s * lambda.tangential, s * lambda.vertical);
}

Variance ProximityModel::wall(const Element& element, const Vec3& p_W) const noexcept {
  if (element.kind != Element::Kind::lateral) return {};
  const Vec3 r = element.c_W - p_W;
  const double s = element.area * wall_factor(r.squaredNorm(), r.z());
  const auto& k1 = model_.wall.k1;
  return Variance::about_normal(element.normal, s * k1.normal, s * k1.tangential, s * k1.vertical);
}

double ProximityModel::corner_factor(double d2, double h) const noexcept {
  const auto& k = model_.corner;
  if (!in_corner_range(d2 + h * h)) return 0;
  // Most points are outside the cone: spare them the arc tangent.
  if (k.phi_max < std::numbers::pi / 2 && (h <= 0 || d2 > 1.0001 * (h * tan_phi_max_) * (h * tan_phi_max_))) return 0;
  const double phi = std::atan2(std::sqrt(d2), h);
  if (phi >= k.phi_max) return 0;  // at φ̄_c itself the term is zero
  const auto sixth = [](double x) { return x * x * x * x * x * x; };
  return (k.phi_max - phi) / std::max(d2 + sixth(h), sixth(least_l_));
}

double ProximityModel::wall_factor(double r2, double r_z) const noexcept {
  const auto& k = model_.wall;
  if (r_z > 1e-6 * (1 + k.l_max)) return 0;  // far above level: spare it the root
  const double distance = std::sqrt(r2), l = std::max(distance, least_l_);
  const double cos_theta = distance > 0 ? -r_z / distance : 1;
  if (l > k.l_max + kTolerance || cos_theta > cos_wall_min_ || cos_theta < cos_level_) return 0;
  return std::exp(-k.k2 * l * l);
}

ProximityModel::Gate ProximityModel::wall_gate(double r_z) const noexcept {
  // θ_w ≤ θ: −r_z/|r| ≤ cos θ_w; θ ≤ π/2: −r_z/|r| ≥ cos π/2 (with the tolerances).
  constexpr Gate kNever{1, 0};
  Gate gate{0, (model_.wall.l_max + kTolerance) * (model_.wall.l_max + kTolerance)};
  const double down = -r_z;
  if (down > 0 && cos_wall_min_ <= 0) return kNever;
  if (down > 0) gate.low = down * down / (cos_wall_min_ * cos_wall_min_);
  if (down == 0 && cos_wall_min_ < 0) return kNever;
  if (down < 0) {
    gate.low = down * down / (cos_level_ * cos_level_);
    if (cos_wall_min_ < 0) gate.high = std::min(gate.high, down * down / (cos_wall_min_ * cos_wall_min_));
  }
  return gate;
}

bool ProximityModel::in_wall_range(double r2) const noexcept {
  return r2 <= (model_.wall.l_max + kTolerance) * (model_.wall.l_max + kTolerance);
}

}  // namespace backwash::field

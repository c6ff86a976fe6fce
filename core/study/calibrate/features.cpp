// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/calibrate/features.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/field/disturbance_field.hpp"

namespace backwash::study::calibrate {
namespace {

constexpr double kLeastDecay = kCalibrationRules.least_decay, kDecayRatio = kCalibrationRules.decay_ratio;

/// Key and place of each parameter, in the order of Parameter.
struct Place {
  std::string_view key;
  double& (*in)(Model&);
};
constexpr std::array<Place, kParameters> kPlaces{{
    {"base.horizontal", [](Model& m) -> double& { return m.base.horizontal; }},
    {"base.vertical", [](Model& m) -> double& { return m.base.vertical; }},
    {"ground.lambda.horizontal", [](Model& m) -> double& { return m.ground.lambda.horizontal; }},
    {"ground.lambda.vertical", [](Model& m) -> double& { return m.ground.lambda.vertical; }},
    {"ground.k1.horizontal", [](Model& m) -> double& { return m.ground.k1.horizontal; }},
    {"ground.k1.vertical", [](Model& m) -> double& { return m.ground.k1.vertical; }},
    {"corner.lambda.normal", [](Model& m) -> double& { return m.corner.lambda.normal; }},
    {"corner.lambda.tangential", [](Model& m) -> double& { return m.corner.lambda.tangential; }},
    {"corner.lambda.vertical", [](Model& m) -> double& { return m.corner.lambda.vertical; }},
    {"wall.k1.normal", [](Model& m) -> double& { return m.wall.k1.normal; }},
    {"wall.k1.tangential", [](Model& m) -> double& { return m.wall.k1.tangential; }},
    {"wall.k1.vertical", [](Model& m) -> double& { return m.wall.k1.vertical; }},
    {"ground.k2", [](Model& m) -> double& { return m.ground.k2; }},
    {"wall.k2", [](Model& m) -> double& { return m.wall.k2; }},
}};

/// A model whose breakdown is the features for one decay: horizontal and vertical (normal and vertical) amplitudes are
/// set apart so that one evaluation tells the sums from each other.
Model probe(const Model& gates, double decay) {
  Model m = gates;
  m.base = {0, 0};
  m.ground.lambda = {1, 0};
  m.ground.k1 = {0, 1};
  m.corner.lambda = {1, 0, 1};
  m.wall.k1 = {1, 0, 1};
  m.ground.k2 = m.wall.k2 = decay;
  return m;
}

double height_above_floor(const map::OccupancyGrid& grid, const Vec3& p_W) {
  Index3 v = grid.index(p_W);
  while (grid.free(v)) v.z() -= 1;
  return grid.occupied(v) ? p_W.z() - (grid.center(v).z() + grid.resolution() / 2) : kFar;
}

struct Cubic {
  double value, slope;  ///< slope by ln k
};
/// Catmull-Rom in (ln k, ln value); 0 where a stored value is 0 (outside every gate).
Cubic interpolated(const std::array<double, kDecays>& stored, double ln_k) {
  const double step = std::log(kDecayRatio);
  const double at = std::clamp((ln_k - std::log(kLeastDecay)) / step, 0.0, static_cast<double>(kDecays - 1));
  const auto i = std::min(static_cast<std::size_t>(at), kDecays - 2);
  const double t = at - static_cast<double>(i);
  const double a = stored[i > 0 ? i - 1 : 0], b = stored[i], c = stored[i + 1],
               d = stored[std::min(i + 2, kDecays - 1)];
  if (a <= 0 || b <= 0 || c <= 0 || d <= 0) return {0, 0};
  const double y1 = std::log(b), y2 = std::log(c);
  const double y0 = i > 0 ? std::log(a) : 2 * y1 - y2, y3 = i + 2 < kDecays ? std::log(d) : 2 * y2 - y1;
  const double m1 = 0.5 * (y2 - y0), m2 = 0.5 * (y3 - y1), rise = y2 - y1;
  const double c2 = 3 * rise - 2 * m1 - m2, c3 = m1 + m2 - 2 * rise;
  const double value = std::exp(y1 + t * (m1 + t * (c2 + t * c3)));
  return {value, value * (m1 + t * (2 * c2 + 3 * t * c3)) / step};
}

}  // namespace

std::string_view key(Parameter p) noexcept { return kPlaces[p].key; }

Parameters parameters_of(const Model& model) noexcept {
  Model copy = model;
  Parameters values{};
  for (std::size_t p = 0; p < kParameters; ++p) values[p] = kPlaces[p].in(copy);
  return values;
}

Model with_parameters(const Model& gates, const Parameters& parameters) noexcept {
  Model model = gates;
  for (std::size_t p = 0; p < kParameters; ++p) kPlaces[p].in(model) = parameters[p];
  return model;
}

const std::array<double, kDecays>& decay_grid() noexcept {
  static const std::array<double, kDecays> grid = [] {
    std::array<double, kDecays> k{};
    for (std::size_t i = 0; i < kDecays; ++i) k[i] = kLeastDecay * std::pow(kDecayRatio, static_cast<double>(i));
    return k;
  }();
  return grid;
}

std::vector<Features> features(const map::OccupancyGrid& grid, const Model& gates, std::span<const Vec3> points_W) {
  std::vector<Features> all(points_W.size());
  for (std::size_t k = 0; k < kDecays; ++k) {
    const field::ProximityField field(grid, probe(gates, decay_grid()[k]));
    for (std::size_t n = 0; n < points_W.size(); ++n) {
      const auto parts = field.at(points_W[n]);
      Features& f = all[n];
      if (k == 0) {
        f.ground_inverse = parts.ground.xx;
        f.corner_xx = parts.corner.xx;
        f.corner = parts.corner.zz;
      }
      f.ground_decay[k] = parts.ground.zz;
      f.wall_xx[k] = parts.wall.xx;
      f.wall[k] = parts.wall.zz;
    }
  }
  std::vector<field::Element> lateral = field::surface_elements(grid);
  std::erase_if(lateral, [](const field::Element& e) { return e.kind != field::Element::Kind::lateral; });
  for (std::size_t n = 0; n < points_W.size(); ++n) {
    double nearest = kFar;
    for (const auto& e : lateral) {
      const Vec3 r = points_W[n] - e.c_W;
      if (e.normal.dot(r) > 0) nearest = std::min(nearest, r.squaredNorm());
    }
    all[n].wall_distance = std::sqrt(nearest);
    all[n].height = height_above_floor(grid, points_W[n]);
  }
  return all;
}

FeaturesAt at_decays(const Features& f, double ln_ground_k2, double ln_wall_k2) noexcept {
  const Cubic ground = interpolated(f.ground_decay, ln_ground_k2), xx = interpolated(f.wall_xx, ln_wall_k2),
              wall = interpolated(f.wall, ln_wall_k2);
  return {ground.value, ground.slope, xx.value, xx.slope, wall.value, wall.slope};
}

std::array<double, kAmplitudes> factors(const Features& f, const FeaturesAt& d, int axis) noexcept {
  std::array<double, kAmplitudes> x{};
  if (axis == 2) {
    x[kBaseZ] = 1;
    x[kGroundLambdaZ] = f.ground_inverse;
    x[kGroundK1Z] = d.ground_decay;
    x[kCornerZ] = f.corner;
    x[kWallZ] = d.wall;
    return x;
  }
  // m mᵀ along this axis, and t tᵀ = 1 − m mᵀ in the plane.
  const double corner = axis == 0 ? f.corner_xx : f.corner - f.corner_xx;
  const double wall = axis == 0 ? d.wall_xx : d.wall - d.wall_xx;
  x[kBaseH] = 1;
  x[kGroundLambdaH] = f.ground_inverse;
  x[kGroundK1H] = d.ground_decay;
  x[kCornerN] = corner;
  x[kCornerT] = f.corner - corner;
  x[kWallN] = wall;
  x[kWallT] = d.wall - wall;
  return x;
}

}  // namespace backwash::study::calibrate

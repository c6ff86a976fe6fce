// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/study/calibrate/calibration_rules.hpp"
#include "core/types/model.hpp"

namespace backwash::study::calibrate {

/// The constants that hover flights determine. Σ is linear in all but the last two, which enter as their logarithms.
enum Parameter : std::size_t {
  kBaseH,
  kBaseZ,
  kGroundLambdaH,
  kGroundLambdaZ,
  kGroundK1H,
  kGroundK1Z,
  kCornerN,
  kCornerT,
  kCornerZ,
  kWallN,
  kWallT,
  kWallZ,
  kGroundK2,
  kWallK2,
  kParameters
};
inline constexpr std::size_t kAmplitudes = kGroundK2;
/// One number per Parameter, in the units of the model file.
using Parameters = std::array<double, kParameters>;

/// Dotted key of the model file, as in "wall.k1.normal".
std::string_view key(Parameter p) noexcept;
Parameters parameters_of(const Model& model) noexcept;
/// `gates` with these parameters in the place of its own.
Model with_parameters(const Model& gates, const Parameters& parameters) noexcept;

/// Values of k_g2 and k_w2 at which features are stored, 1/m²: between them features are interpolated.
inline constexpr auto kDecays = static_cast<std::size_t>(kCalibrationRules.decays);
const std::array<double, kDecays>& decay_grid() noexcept;

/// Distance to what is not there, m.
inline constexpr double kFar = std::numeric_limits<double>::infinity();

/// What the geometry around a point contributes to Σ for amplitude 1 (docs/model.md section 2), summed over visible
/// elements.
struct Features {
  double ground_inverse;     ///< Σ A/l²
  double corner_xx, corner;  ///< Σ A f m_x² and Σ A f, f the corner's factor without λ_c; yy is the difference
  std::array<double, kDecays> ground_decay;   ///< Σ A e^(−k l²) for each k of decay_grid()
  std::array<double, kDecays> wall_xx, wall;  ///< the same of the wall term, with m_x² and without
  double wall_distance;  ///< to the nearest lateral element that faces the point, m; infinity without one
  double height;         ///< above the floor under the point, m; infinity without one
};
/// Features at points of a map, with the gates of a model and r0 = its ground.r0: 16 exact field evaluations each,
/// about 0.5 ms a point.
std::vector<Features> features(const map::OccupancyGrid& grid, const Model& gates, std::span<const Vec3> points_W);

/// Features for one pair of decays, with derivatives by ln k_g2 and ln k_w2: cubic in ln k between the stored ones.
struct FeaturesAt {
  double ground_decay, ground_slope;
  double wall_xx, wall_xx_slope, wall, wall_slope;
};
FeaturesAt at_decays(const Features& f, double ln_ground_k2, double ln_wall_k2) noexcept;

/// Factors of the 12 amplitudes in Σ along a world axis (0, 1, 2), and derivatives of Σ by the two ln k2 for given
/// amplitudes.
std::array<double, kAmplitudes> factors(const Features& f, const FeaturesAt& d, int axis) noexcept;

}  // namespace backwash::study::calibrate

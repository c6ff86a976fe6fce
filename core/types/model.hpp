// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/types/disturbance.hpp"

namespace backwash {

/// What an accepted cause of the study adds to the model (core/study/README.md, "Extension"): an entry of
/// [[extension.term]].effect. `error`: half width of the value's 95 % interval, what stays unknown.
struct ModelEffect {
  enum class Kind {
    push,                   ///< value: m/s² along x, y, z of W, everywhere
    push_over_surface,      ///< z push value·e^{−(h − 0.4 m)/scale}, h the height over the surface below, m/s²
    push_under_surface,     ///< z push value·e^{−(d − 0.3 m)/scale}, d the gap to the surface above, m/s²
    push_to_walls,          ///< push value·e^{−(d − 0.4 m)/scale} towards each wall at distance d, m/s²
    push_against_velocity,  ///< level push −value·v, 1/s
    push_with_speed,        ///< z push value·(|v|/1 m/s)², m/s²
    ln_variance,            ///< ln Σ + value, everywhere
    ln_variance_under_surface,  ///< ln Σ + value·e^{−(d − 0.3 m)/scale}
    ln_variance_with_speed,     ///< ln Σ + value·(|v|/1 m/s)^scale
  };
  Kind kind = Kind::push;
  Vec3 value = Vec3::Zero(), error = Vec3::Zero();  ///< x alone, but for `push`
  double scale = 0;                                 ///< m, or the exponent
};

/// Disturbance model, the content of a model file (docs/interfaces.md, "Model file"). The defaults are the documented
/// default model of the 5-inch vehicle. Variances in (m/s²)², lengths in m, angles in rad.
struct Model {
  struct {
    double horizontal = 0.004, vertical = 0.006;  ///< Σ_0, (m/s²)²
  } base;
  struct {
    double theta_max = 1.05;       ///< θ̄_g, rad
    double l_max = 2.0;            ///< l̄_g, m
    double l_footprint_max = 4.0;  ///< l̄_u, m
    double r0 = 0.18;              ///< diagonal radius of the vehicle, m; a vehicle file's value takes its place
    struct {
      double horizontal = 0.010, vertical = 0.020;
    } lambda;  ///< λ_g, (m/s²)²
    struct {
      double horizontal = 0.05, vertical = 0.12;
    } k1;             ///< k_g1, (m/s²)²/m²
    double k2 = 3.0;  ///< k_g2, 1/m²
  } ground;
  struct {
    double phi_max = 1.2;  ///< φ̄_c, rad
    double l_max = 1.5;    ///< l̄_c, m
    struct {
      double normal = 0.02, tangential = 0.012, vertical = 0.02;
    } lambda;  ///< λ_c
  } corner;
  struct {
    double theta_min = 0.9;  ///< θ_w, rad
    double l_max = 1.5;      ///< l̄_w, m
    struct {
      double normal = 0.25, tangential = 0.10, vertical = 0.12;
    } k1;             ///< k_w1, (m/s²)²/m²
    double k2 = 2.5;  ///< k_w2, 1/m²
  } wall;
  BoundModel bound;
  std::vector<ModelEffect> extension;
};

}  // namespace backwash

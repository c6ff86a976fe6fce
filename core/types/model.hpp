// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/types/disturbance.hpp"
#include "core/types/law.hpp"

namespace backwash {

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
  /// Where a free voxel stands on an unknown one a floor may be, and shakes the vehicle as one does. For maps that show
  /// what is near alone; no key of the file. In a world what is below the map's lowest layer is unknown as well.
  bool unknown_floor = false;
};

}  // namespace backwash

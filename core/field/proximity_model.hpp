// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/field/surface.hpp"
#include "core/types/model.hpp"

namespace backwash::field {

/// Contribution of one visible element to Σ at p, (m/s²)²: the three terms of model.md section 2 (paper Eq. 1–3), all
/// gates included, visibility not. Each is zero for the wrong kind of element.
Variance ground_term(const Model& model, double voxel_edge, const Element& element, const Vec3& p_W) noexcept;
Variance corner_term(const Model& model, double voxel_edge, const Element& element, const Vec3& p_W) noexcept;
Variance wall_term(const Model& model, double voxel_edge, const Element& element, const Vec3& p_W) noexcept;

}  // namespace backwash::field

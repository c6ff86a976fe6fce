// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "services/maps/geometry.hpp"

namespace backwash::maps {

/// Adds a face of the file as triangles: a corner is a place, two are a line, and what has more is cut into ears. Where
/// it crosses itself, or has no plane, it is a fan around its first corner, which covers all of it and maybe more: that
/// is counted in `fans`. `line` is where the file says it, or 0. Precondition: the corners are in geometry.points.
/// O(corners²), seldom O(corners³).
void add_face(Geometry& geometry, std::span<const std::uint32_t> corners, std::size_t line);

}  // namespace backwash::maps

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "core/types/geometry.hpp"

namespace backwash {

/// A row of a points file that is flown (docs/interfaces.md, "Points CSV"): a place to rest at, and a heading there.
struct Waypoint {
  Vec3 p_W = Vec3::Zero();  ///< m
  std::optional<double> yaw =
      {};  ///< rad, of the body's x axis from the map's, counter-clockwise; none: as the path leads
};

}  // namespace backwash

// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/vehicle/ray.hpp"

#include <limits>

namespace backwash::sim {

std::optional<double> cast_ray(const map::OccupancyGrid& grid, const Vec3& p_W, const Vec3& direction, double range) {
  const double a = grid.resolution();
  Index3 v = grid.index(p_W);
  Index3 sign;
  Vec3 next, between;  // along the ray: distance to the next face and between faces, per axis
  for (int i = 0; i < 3; ++i) {
    sign[i] = direction[i] > 0 ? 1 : -1;
    const double face = grid.origin()[i] + a * (v[i] + (sign[i] > 0 ? 1 : 0));
    const bool moves = std::abs(direction[i]) > 1e-12;
    next[i] = moves ? (face - p_W[i]) / direction[i] : std::numeric_limits<double>::infinity();
    between[i] = moves ? a / std::abs(direction[i]) : 0;
  }
  for (double at = 0; at <= range;) {
    if (grid.occupied(v)) return at;
    int axis = 0;
    at = next.minCoeff(&axis);
    v[axis] += sign[axis];
    next[axis] += between[axis];
  }
  return std::nullopt;
}

}  // namespace backwash::sim

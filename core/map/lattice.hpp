// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/types/geometry.hpp"

namespace backwash::map {

/// Whether a grid of so many voxels along x, y, z has voxel v. Real-time: wait-free, no allocation.
inline bool inside(const Index3& size, const Index3& v) noexcept {
  return v.x() >= 0 && v.y() >= 0 && v.z() >= 0 && v.x() < size.x() && v.y() < size.y() && v.z() < size.z();
}

/// Position of a voxel in an array over such a grid: x runs fastest. Precondition: inside(size, v).
inline std::size_t linear(const Index3& size, const Index3& v) noexcept {
  return static_cast<std::size_t>(v.x()) +
         static_cast<std::size_t>(size.x()) *
             (static_cast<std::size_t>(v.y()) + static_cast<std::size_t>(size.y()) * static_cast<std::size_t>(v.z()));
}

/// The voxel at a position in such an array. Precondition: within it.
inline Index3 voxel(const Index3& size, std::size_t linear) noexcept {
  const auto sx = static_cast<std::size_t>(size.x()), sy = static_cast<std::size_t>(size.y());
  return {static_cast<int>(linear % sx), static_cast<int>(linear / sx % sy), static_cast<int>(linear / (sx * sy))};
}

/// Calls visit(v, share) for the eight points v of the integer lattice about q, x fastest; share.prod() is the point's
/// trilinear weight, and along an axis the weights of both ends add up to 1. Precondition: q within the range of int.
/// Real-time as visit is: wait-free, no allocation.
template <class Visit>
void for_corners(const Vec3& q, Visit&& visit) {
  const Vec3 low = q.array().floor(), t = q - low;
  const Index3 base = low.template cast<int>();
  for (int corner = 0; corner < 8; ++corner) {
    const Index3 step(corner & 1, corner >> 1 & 1, corner >> 2);
    const Vec3 share(step.x() ? t.x() : 1 - t.x(), step.y() ? t.y() : 1 - t.y(), step.z() ? t.z() : 1 - t.z());
    visit(Index3(base + step), share);
  }
}

}  // namespace backwash::map

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace backwash::field {

/// One offset, one layer of a block: for each of `rows` (a multiple of 8) rows of 64 voxels,
///   lanes = targets[y] & elements[y] & ~OR of occupied[y + step] over the steps
/// and `horizontal`, `vertical` are added to the sums ([y][64], bit x is lane x) of the lanes. Picks the processor's
/// vector width at run time (x86) or compile time. Real-time: wait-free, no allocation.
void add_visible(const std::uint64_t* targets, const std::uint64_t* elements, const std::uint64_t* occupied,
                 std::span<const std::int32_t> steps, std::size_t rows, float horizontal, float vertical,
                 float* horizontal_sums, float* vertical_sums) noexcept;

/// One segment of lateral elements seen from the heights 0 … count − 1 of a column: all of its elements within the
/// stretch of free heights. `decay[n]`: Σ exp(−k_w2 a² i²) over i < n.
struct Stack {
  int from, to;           ///< elements, heights relative to that of entry 0
  int wall_range, range;  ///< as in LateralSweep::Line
  const double* decay;
};
/// wall[z] = Σ exp(−k_w2 a² n²), seen[z] = number of elements in range, as seen from height z.
/// Real-time: wait-free, no allocation.
void see_stack(const Stack& stack, int first, int last, double* wall, double* seen) noexcept;

struct Factors {
  double xx, xy, yy, zz;
};
/// Lateral elements of one normal and one floor as seen from a column; heights count from that of entry 0.
struct LateralTerms {
  Factors wall, corner;  ///< per unit of the wall's and the corner's factors
  double voxel_edge, d2, phi_max;
  int floor;  ///< height of the voxel under the corners
};
struct LateralSums {
  double *xx, *xy, *yy, *zz;
};
/// Adds the terms of a stack: sums[z] += wall · wall[z] + corner · seen[z] (φ̄_c − φ)/(d_c² + h_c⁶) per component for
/// first ≤ z ≤ last; no corner term where `with_corner` has no bit. The fraction is ProximityModel::corner_factor()
/// within its gates, to 1e-6. Real-time: wait-free, no allocation.
void add_stack(const LateralTerms& terms, int first, int last, std::uint64_t with_corner, const double* wall,
               const double* seen, const LateralSums& sums) noexcept;
/// The same for a single element: wall[z] = step[z] at the bits of `with_wall`, seen[z] = 1.
void add_element(const LateralTerms& terms, const double* step, std::uint64_t with_wall, std::uint64_t with_corner,
                 const LateralSums& sums) noexcept;

}  // namespace backwash::field

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

/// factors[n] times (φ̄_c − φ)/(d_c² + h_c⁶) at the heights h_c = a (up − 1/2), up = first … first + count − 1: what
/// ProximityModel::corner_factor() gives within its gates, to 1e-6 or better. Real-time: wait-free, no allocation.
struct CornerLine {
  double voxel_edge, d2, phi_max;
};
void scale_by_corner(const CornerLine& line, int first, int count, double* factors) noexcept;

/// sums[z] += wall_term · wall[z] + corner_term · corner[z] per component for first ≤ z ≤ last.
/// Real-time: wait-free, no allocation.
struct Factors {
  double xx, xy, yy, zz;
};
void add_terms(const Factors& wall_term, const Factors& corner_term, const double* wall, const double* corner,
               int first, int last, double* xx, double* xy, double* yy, double* zz) noexcept;

}  // namespace backwash::field

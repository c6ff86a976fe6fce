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

}  // namespace backwash::field

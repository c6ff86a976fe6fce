// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/kernels.hpp"

#include <cstring>

#include "core/field/vector_levels.hpp"

namespace backwash::field {
namespace {

// Compilers split these into what the processor has.
using Words = std::uint64_t __attribute__((vector_size(64)));
using Floats = float __attribute__((vector_size(64)));
using Ints = std::int32_t __attribute__((vector_size(64)));

constexpr Ints kBits{1 << 0, 1 << 1, 1 << 2,  1 << 3,  1 << 4,  1 << 5,  1 << 6,  1 << 7,
                     1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, 1 << 15};

}  // namespace

BACKWASH_CLONES
void add_visible(const std::uint64_t* targets, const std::uint64_t* elements, const std::uint64_t* occupied,
                 std::span<const std::int32_t> steps, std::size_t rows, float horizontal, float vertical,
                 float* horizontal_sums, float* vertical_sums) noexcept {
  constexpr std::size_t kWords = 8, kLanes = 16;
  const Ints h = reinterpret_cast<Ints>(Floats{} + horizontal), v = reinterpret_cast<Ints>(Floats{} + vertical);
  for (std::size_t y = 0; y < rows; y += kWords) {
    Words lanes, other;
    std::memcpy(&lanes, targets + y, sizeof lanes);
    std::memcpy(&other, elements + y, sizeof other);
    lanes &= other;
    const auto any = [&] {
      std::uint64_t all = 0;
      for (std::size_t n = 0; n < kWords; ++n) all |= lanes[n];
      return all != 0;
    };
    if (!any()) continue;
    for (const std::int32_t step : steps) {
      std::memcpy(&other, occupied + y + step, sizeof other);
      lanes &= ~other;
    }
    for (std::size_t n = 0; n < kWords; ++n) {
      std::uint64_t word = lanes[n];
      if (!word) continue;
      for (std::size_t at = 64 * (y + n); word; at += kLanes, word >>= kLanes) {
        const Ints mask = ((Ints{} + static_cast<std::int32_t>(word & 0xffff)) & kBits) != 0;
        Floats sum;
        std::memcpy(&sum, horizontal_sums + at, sizeof sum);
        sum += reinterpret_cast<Floats>(mask & h);
        std::memcpy(horizontal_sums + at, &sum, sizeof sum);
        std::memcpy(&sum, vertical_sums + at, sizeof sum);
        sum += reinterpret_cast<Floats>(mask & v);
        std::memcpy(vertical_sums + at, &sum, sizeof sum);
      }
    }
  }
}

}  // namespace backwash::field

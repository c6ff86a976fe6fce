// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/lateral/kernels.hpp"

#include <array>
#include <cstring>

#include "core/field/lateral/vector_levels.hpp"
#include "core/field/lateral/vectors.hpp"

namespace backwash::field {
namespace {

constexpr std::size_t kFloats = 16;
constexpr std::array<std::int32_t, kFloats> kBitOf{1 << 0,  1 << 1,  1 << 2,  1 << 3, 1 << 4,  1 << 5,
                                                   1 << 6,  1 << 7,  1 << 8,  1 << 9, 1 << 10, 1 << 11,
                                                   1 << 12, 1 << 13, 1 << 14, 1 << 15};

/// sums[n] += the number, at the bits n of the word's lowest 16.
template <std::size_t kPiece>
[[gnu::always_inline]] inline void add_at(std::uint64_t word, float horizontal, float vertical, float* horizontal_sums,
                                          float* vertical_sums) noexcept {
  using Floats = typename vectors::Native<kPiece>::Floats;
  using Ints = typename vectors::Native<kPiece>::Ints;
  const Ints all = Ints{} + static_cast<std::int32_t>(word & 0xffff), h = reinterpret_cast<Ints>(Floats{} + horizontal),
             v = reinterpret_cast<Ints>(Floats{} + vertical);
  for (std::size_t n = 0; n < kFloats; n += kPiece / sizeof(float)) {
    Ints bits;
    std::memcpy(&bits, kBitOf.data() + n, sizeof bits);
    const Ints mask = (all & bits) != 0;
    Floats sum;
    std::memcpy(&sum, horizontal_sums + n, sizeof sum);
    sum += reinterpret_cast<Floats>(mask & h);
    std::memcpy(horizontal_sums + n, &sum, sizeof sum);
    std::memcpy(&sum, vertical_sums + n, sizeof sum);
    sum += reinterpret_cast<Floats>(mask & v);
    std::memcpy(vertical_sums + n, &sum, sizeof sum);
  }
}

struct AddVisible {
  template <std::size_t kPiece>
  [[gnu::always_inline]] static void run(const std::uint64_t* targets, const std::uint64_t* elements,
                                         const std::uint64_t* occupied, std::span<const std::int32_t> steps,
                                         std::size_t rows, float horizontal, float vertical, float* horizontal_sums,
                                         float* vertical_sums) noexcept {
    using Words = typename vectors::Native<kPiece>::Words;
    constexpr std::size_t kWords = kPiece / sizeof(std::uint64_t);
    for (std::size_t y = 0; y < rows; y += kWords) {
      Words lanes, other;
      std::memcpy(&lanes, targets + y, sizeof lanes);
      std::memcpy(&other, elements + y, sizeof other);
      lanes &= other;
      std::uint64_t any = 0;
      for (std::size_t n = 0; n < kWords; ++n) any |= lanes[n];
      if (!any) continue;
      for (const std::int32_t step : steps) {
        std::memcpy(&other, occupied + y + step, sizeof other);
        lanes &= ~other;
      }
      for (std::size_t n = 0; n < kWords; ++n) {
        std::uint64_t word = lanes[n];
        for (std::size_t at = 64 * (y + n); word; at += kFloats, word >>= kFloats)
          add_at<kPiece>(word, horizontal, vertical, horizontal_sums + at, vertical_sums + at);
      }
    }
  }
};

}  // namespace

void add_visible(const std::uint64_t* targets, const std::uint64_t* elements, const std::uint64_t* occupied,
                 std::span<const std::int32_t> steps, std::size_t rows, float horizontal, float vertical,
                 float* horizontal_sums, float* vertical_sums) noexcept {
  run_native<AddVisible>(targets, elements, occupied, steps, rows, horizontal, vertical, horizontal_sums,
                         vertical_sums);
}

}  // namespace backwash::field

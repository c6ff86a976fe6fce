// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/kernels.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>

// Loaders that call a resolver before a sanitizer has started would crash.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define BACKWASH_CLONES [[gnu::target_clones("avx512f", "avx2", "default")]]
#else
#define BACKWASH_CLONES
#endif

namespace backwash::field {
namespace {

// Compilers split these into what the processor has.
using Words = std::uint64_t __attribute__((vector_size(64)));
using Floats = float __attribute__((vector_size(64)));
using Ints = std::int32_t __attribute__((vector_size(64)));

constexpr Ints kBits{1 << 0, 1 << 1, 1 << 2,  1 << 3,  1 << 4,  1 << 5,  1 << 6,  1 << 7,
                     1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, 1 << 15};

/// (φ̄_c − φ)/(d_c² + h_c⁶) at the heights first … last.
[[gnu::always_inline]] inline void corner_factors(const LateralTerms& terms, int first, int last,
                                                  double* __restrict factors) {
  // atan x over −1 ≤ x ≤ 1 to 2e-8: Abramowitz and Stegun, Handbook of Mathematical Functions, 4.4.49.
  constexpr float k2 = -0.3333314528F, k4 = 0.1999355085F, k6 = -0.1420889944F, k8 = 0.1065626393F,
                  k10 = -0.0752896400F, k12 = 0.0429096138F, k14 = -0.0161657367F, k16 = 0.0028662257F;
  constexpr float kPi = std::numbers::pi_v<float>;
  const auto a = static_cast<float>(terms.voxel_edge), d2 = static_cast<float>(terms.d2), d = std::sqrt(d2);
  const auto phi_max = static_cast<float>(terms.phi_max);
  const float least = a * a * a * a * a * a / 64;
  for (int z = first; z <= last; ++z) {
    const float h = a * (static_cast<float>(z - terms.floor) - 0.5F), height = std::abs(h), h2 = h * h;
    const float x = (d - height) / (d + height), x2 = x * x;
    const float series = k2 + x2 * (k4 + x2 * (k6 + x2 * (k8 + x2 * (k10 + x2 * (k12 + x2 * (k14 + x2 * k16))))));
    const float acute = kPi / 4 + x + x * x2 * series, phi = h > 0 ? acute : kPi - acute;
    factors[z] = static_cast<double>(std::max(phi_max - phi, 0.0F) / std::max(d2 + h2 * h2 * h2, least));
  }
}

[[gnu::always_inline]] inline void add_terms(const LateralTerms& terms, int first, int last,
                                             const double* __restrict wall, const double* __restrict corner,
                                             const LateralSums& sums) {
  double* __restrict xx = sums.xx, * __restrict xy = sums.xy, * __restrict yy = sums.yy, * __restrict zz = sums.zz;
  const Factors w = terms.wall, c = terms.corner;
  for (int z = first; z <= last; ++z) {
    xx[z] += w.xx * wall[z] + c.xx * corner[z];
    xy[z] += w.xy * wall[z] + c.xy * corner[z];
    yy[z] += w.yy * wall[z] + c.yy * corner[z];
    zz[z] += w.zz * wall[z] + c.zz * corner[z];
  }
}

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

BACKWASH_CLONES
void see_stack(const Stack& stack, int first, int last, double* wall, double* seen) noexcept {
  const int end = stack.wall_range + 1, from = stack.from, to = stack.to, range = stack.range;
  const double* decay = stack.decay;
  for (int z = first; z <= last; ++z) {
    const int farthest = std::min(std::max(z - from + 1, 0), end), nearest = std::min(std::max(z - to, 0), end);
    wall[z] = decay[farthest] - decay[nearest];
    seen[z] = std::max(0, std::min(to, z + range) - std::max(from, z - range) + 1);
  }
}

BACKWASH_CLONES
void add_stack(const LateralTerms& terms, int first, int last, std::uint64_t with_corner, const double* wall,
               const double* seen, const LateralSums& sums) noexcept {
  std::array<double, 64> corner;
  for (int z = first; z <= last; ++z) corner[z] = 0;
  if (with_corner) {
    corner_factors(terms, std::max(first, std::countr_zero(with_corner)),
                   std::min(last, 63 - std::countl_zero(with_corner)), corner.data());
    for (int z = first; z <= last; ++z) corner[z] *= seen[z];
  }
  add_terms(terms, first, last, wall, corner.data(), sums);
}

BACKWASH_CLONES
void add_element(const LateralTerms& terms, const double* step, std::uint64_t with_wall, std::uint64_t with_corner,
                 const LateralSums& sums) noexcept {
  std::array<double, 64> wall, corner;
  const std::uint64_t any = with_wall | with_corner;
  const int first = std::countr_zero(any), last = 63 - std::countl_zero(any);
  for (int z = first; z <= last; ++z) wall[z] = with_wall >> z & 1 ? step[z] : 0;
  for (int z = first; z <= last; ++z) corner[z] = 0;
  if (with_corner) {
    const int low = std::countr_zero(with_corner), high = 63 - std::countl_zero(with_corner);
    corner_factors(terms, low, high, corner.data());
    for (int z = low; z <= high; ++z) corner[z] = with_corner >> z & 1 ? corner[z] : 0;
  }
  add_terms(terms, first, last, wall.data(), corner.data(), sums);
}

}  // namespace backwash::field

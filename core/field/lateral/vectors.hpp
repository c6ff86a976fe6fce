// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "core/field/lateral/lateral_kernels.hpp"
#include "core/field/sight/sight.hpp"

/// Eight numbers at once, for the kernels. Nothing takes or gives a vector by value: how one is handed over depends on
/// the processor.
namespace backwash::field::vectors {

// Compilers split these into what the processor has.
using Words = std::uint64_t __attribute__((vector_size(64)));
using Floats = float __attribute__((vector_size(64)));
using Ints = std::int32_t __attribute__((vector_size(64)));
using Doubles = double __attribute__((vector_size(64)));
using Longs = std::int64_t __attribute__((vector_size(64)));
using EightInts = std::int32_t __attribute__((vector_size(32)));
using Quad = double __attribute__((vector_size(32)));
using EightFloats = float __attribute__((vector_size(32)));

/// Vectors of kPiece bytes, for run_native().
template <std::size_t kPiece>
struct Native;
template <>
struct Native<16> {
  using Words = std::uint64_t __attribute__((vector_size(16)));
  using Floats = float __attribute__((vector_size(16)));
  using Ints = std::int32_t __attribute__((vector_size(16)));
  using Doubles = double __attribute__((vector_size(16)));
};
template <>
struct Native<32> {
  using Words = std::uint64_t __attribute__((vector_size(32)));
  using Floats = vectors::EightFloats;
  using Ints = vectors::EightInts;
  using Doubles = vectors::Quad;
};

constexpr double kHalf = 0.5 + kTouch;  // of a closed box with its tolerance, voxel edges
constexpr double kRound = 0x1.8p52;     // x + kRound has the nearest integer to x in its last bits

template <typename Vector, typename Number>
[[gnu::always_inline]] inline void load(Vector& vector, const Number* from) noexcept {
  std::memcpy(&vector, from, sizeof vector);
}
[[gnu::always_inline]] inline void load_ints(Doubles& vector, const std::int32_t* from) noexcept {
  EightInts ints;
  load(ints, from);
  vector = __builtin_convertvector(ints, Doubles);
}
template <typename Vector, typename Number>
[[gnu::always_inline]] inline void store(const Vector& vector, Number* to) noexcept {
  std::memcpy(to, &vector, sizeof vector);
}
[[gnu::always_inline]] inline void take_root(Doubles& x) noexcept {
  std::array<double, kEight> lanes;
  store(x, lanes.data());
  for (double& lane : lanes) lane = std::sqrt(lane);
  load(x, lanes.data());
}
/// yes where a < b, no elsewhere.
template <std::size_t kPiece>
[[gnu::always_inline]] inline void choose_less(const Doubles& a, const Doubles& b, const Doubles& yes,
                                               const Doubles& no, Doubles& chosen) noexcept {
  constexpr std::size_t kCount = sizeof(Doubles) / kPiece;
  std::array<typename Native<kPiece>::Doubles, kCount> less, more, first, second;
  std::memcpy(less.data(), &a, sizeof a);
  std::memcpy(more.data(), &b, sizeof b);
  std::memcpy(first.data(), &yes, sizeof yes);
  std::memcpy(second.data(), &no, sizeof no);
  for (std::size_t n = 0; n < kCount; ++n) first[n] = less[n] < more[n] ? first[n] : second[n];
  std::memcpy(&chosen, first.data(), sizeof chosen);
}
template <std::size_t kPiece>
[[gnu::always_inline]] inline void take_least(Doubles& x, const Doubles& y) noexcept {
  choose_less<kPiece>(y, x, y, x, x);
}
template <std::size_t kPiece>
[[gnu::always_inline]] inline void take_most(Doubles& x, const Doubles& y) noexcept {
  choose_less<kPiece>(x, y, y, x, x);
}
/// Largest integer ≤ x, |x| < 2⁵¹.
template <std::size_t kPiece>
[[gnu::always_inline]] inline void take_floor(Doubles& x) noexcept {
  const Doubles nearest = (x + kRound) - kRound;
  choose_less<kPiece>(x, nearest, nearest - 1.0, nearest, x);
}
/// yes where x has the sign −, no elsewhere: a choice for all processors alike, without a comparison.
[[gnu::always_inline]] inline void choose_negative(const EightFloats& x, const EightFloats& yes, const EightFloats& no,
                                                   EightFloats& chosen) noexcept {
  const EightInts mask = reinterpret_cast<EightInts>(x) >> 31;
  chosen = reinterpret_cast<EightFloats>((reinterpret_cast<EightInts>(yes) & mask) |
                                         (reinterpret_cast<EightInts>(no) & ~mask));
}

/// Bits 0 … x of words: none for x < 0, all for x ≥ 63.
template <std::size_t kPiece>
[[gnu::always_inline]] inline void take_bits_to(const Doubles& x, Longs& words) noexcept {
  Doubles count = x + 1.0;
  take_most<kPiece>(count, Doubles{});
  take_least<kPiece>(count, Doubles{} + 64.0);
  const Longs n = reinterpret_cast<Longs>(count + kRound) & 127, half = n >> 1;
  words = (((Longs{} + 1) << half) << (n - half)) - 1;
}
/// Bits low … high of words; none if low > high or all are outside.
template <std::size_t kPiece>
[[gnu::always_inline]] inline void take_bits(const Doubles& low, const Doubles& high, Longs& words) noexcept {
  Longs below;
  take_bits_to<kPiece>(low - 1.0, below);
  take_bits_to<kPiece>(high, words);
  words &= ~below;
}
[[gnu::always_inline]] inline void take_size(Doubles& x) noexcept {
  x = reinterpret_cast<Doubles>(reinterpret_cast<Longs>(x) & std::numeric_limits<std::int64_t>::max());
}

[[gnu::always_inline]] inline void load_longs(Longs& vector, const std::int32_t* from) noexcept {
  EightInts ints;
  load(ints, from);
  vector = __builtin_convertvector(ints, Longs);
}
/// How far words about the targets' bit 0 are moved up and down to be about heights z.
[[gnu::always_inline]] inline void take_moves(const std::int32_t* z, Words& up, Words& down) noexcept {
  Longs height, none{};
  load_longs(height, z);
  const Longs above = height - kCentre, below = kCentre - height;
  up = reinterpret_cast<Words>(below > none ? below : none);
  down = reinterpret_cast<Words>(above > none ? above : none);
}
/// All bits below the highest one too.
[[gnu::always_inline]] inline void fill_down(Words& word) noexcept {
  for (const unsigned n : {1U, 2U, 4U, 8U, 16U, 32U}) word |= word >> n;
}

/// The members of eight lines.
struct Lines {
  Doubles per_x, per_y, flat, end;
};
[[gnu::always_inline]] inline void gather(const LineFromAbove* lines, const std::uint32_t* which, Lines& out) noexcept {
  std::array<Quad, 8> row;
  for (std::size_t n = 0; n < kEight; ++n) load(row[n], lines + which[n]);
  std::array<Quad, 2> per_x, per_y, flat, end;
  for (std::size_t n = 0; n < 2; ++n) {
    const Quad* r = row.data() + 4 * n;
    const Quad even01 = __builtin_shufflevector(r[0], r[1], 0, 4, 2, 6),
               odd01 = __builtin_shufflevector(r[0], r[1], 1, 5, 3, 7);
    const Quad even23 = __builtin_shufflevector(r[2], r[3], 0, 4, 2, 6),
               odd23 = __builtin_shufflevector(r[2], r[3], 1, 5, 3, 7);
    per_x[n] = __builtin_shufflevector(even01, even23, 0, 1, 4, 5);
    flat[n] = __builtin_shufflevector(even01, even23, 2, 3, 6, 7);
    per_y[n] = __builtin_shufflevector(odd01, odd23, 0, 1, 4, 5);
    end[n] = __builtin_shufflevector(odd01, odd23, 2, 3, 6, 7);
  }
  load(out.per_x, per_x.data());
  load(out.per_y, per_y.data());
  load(out.flat, flat.data());
  load(out.end, end.data());
}

}  // namespace backwash::field::vectors

// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/lateral/lateral_kernels.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "core/field/lateral/vector_levels.hpp"
#include "core/field/lateral/vectors.hpp"

namespace backwash::field {
namespace {

using namespace vectors;

constexpr std::size_t kAny = 16;  // bytes: every processor has vectors of them

}  // namespace

BACKWASH_CLONES
std::size_t find_near(const Standing& segments, std::uint32_t first, std::uint32_t end, const Looking& looking,
                      std::uint32_t* found) noexcept {
  constexpr std::uint32_t kLanes = 16;
  const auto dy = static_cast<float>(looking.dy);
  std::array<std::uint8_t, kLanes> near;
  std::size_t count = 0;
  for (std::uint32_t begin = first; begin < end; begin += kLanes) {
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const std::uint32_t n = begin + lane;
      const auto dx = static_cast<float>(segments.x[n] - looking.x);
      const float along = dx * segments.m_x[n] + dy * segments.m_y[n];
      near[lane] = (along < -0.499F) & (dx * dx + (dy * dy + 0.25F) + along <= looking.range2) &
                   (segments.low[n] <= looking.high) & (segments.high[n] >= looking.low);
    }
    for (std::uint32_t lane = 0; lane < std::min(kLanes, end - begin); ++lane) {
      found[count] = begin + lane;
      count += near[lane];
    }
  }
  return count;
}

BACKWASH_CLONES
void see(const Seen& seen, std::size_t count, double k2) noexcept {
  constexpr double kPerLn2 = std::numbers::log2e, kLn2High = 0x1.62e42fefa3800p-1, kLn2Low = 0x1.ef35793c76730p-45;
  constexpr std::array kInverse{1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880, 1.0 / 40320, 1.0 / 5040, 1.0 / 720,
                                1.0 / 120,      1.0 / 24,      1.0 / 6,      0.5,         1.0,        1.0};
  for (std::size_t n = 0; n < count; n += kEight) {
    Doubles dx, dy, m_x, m_y;
    load_ints(dx, seen.dx + n);
    load_ints(dy, seen.dy + n);
    load(m_x, seen.m_x + n);
    load(m_y, seen.m_y + n);
    const Doubles along = dx * m_x + dy * m_y, flat2 = dx * dx + dy * dy + 0.25 + along;
    store(along + 0.5, seen.along + n);
    store(flat2, seen.flat2 + n);
    Doubles x = -k2 * flat2;
    take_most<kAny>(x, Doubles{} - 700.0);
    const Doubles shifted = x * kPerLn2 + kRound, power = shifted - kRound;
    const Doubles rest = x - power * kLn2High - power * kLn2Low;
    Doubles series = Doubles{} + kInverse[0];
    for (std::size_t k = 1; k < kInverse.size(); ++k) series = series * rest + kInverse[k];
    store(reinterpret_cast<Longs>(series) + (reinterpret_cast<Longs>(shifted) << 52), seen.decay + n);
  }
}

BACKWASH_CLONES
void make_lines(const double* c_x, const double* c_y, const double* range, std::size_t count,
                LineFromAbove* lines) noexcept {
  for (std::size_t n = 0; n < count; n += kEight) {
    Doubles x, y, r;
    load(x, c_x + n);
    load(y, c_y + n);
    load(r, range + n);
    const Doubles flat2 = x * x + y * y;
    Doubles flat = flat2, length = flat2 + r * r;
    take_root(flat);
    take_root(length);
    take_most<kAny>(length, Doubles{} + 2.0);
    Doubles size_x = x, size_y = y;  // a line along an axis: the other coordinate stays a number
    take_size(size_x);
    take_size(size_y);
    const Doubles per_x = size_x < 1e-9 ? Doubles{} + 1e9 : 1 / x, per_y = size_y < 1e-9 ? Doubles{} + 1e9 : 1 / y;
    const Doubles end = 1 - 2 / length;
    for (std::size_t k = 0; k < kEight; ++k) lines[n + k] = {per_x[k], per_y[k], flat[k], end[k]};
  }
}

BACKWASH_CLONES
void classify(const Elements& elements, std::size_t count, std::uint64_t targets) noexcept {
  const Words one = Words{} + 1, centre = one << kCentre;
  for (std::size_t n = 0; n < count; n += kEight) {
    Words up, down, with_corner, all;
    take_moves(elements.z + n, up, down);
    load(with_corner, elements.with_corner + n);
    load(all, elements.all + n);
    Longs wall_range, range;
    load_longs(wall_range, elements.wall_range + n);
    load_longs(range, elements.range + n);
    const Longs most = Longs{} + kCentre;
    const Words reach = reinterpret_cast<Words>(range < most ? range : most);
    const Words wall = ((one << reinterpret_cast<Words>(wall_range + 1)) - 1) << kCentre;
    const Words corner = ((one << (2 * reach + 1)) - 1) << (static_cast<std::uint64_t>(kCentre) - reach);
    const Words near = ((Words{} + targets) << up >> down) & (wall | (with_corner << up >> down & corner));
    Words ends = near | centre;
    const Words upwards = ends | -ends;
    fill_down(ends);
    const Words occupied = all & upwards & ends, above = occupied & -centre;
    Words below = occupied & (centre - 1);
    fill_down(below);
    const Words certain = near & ((above & -above) - 1) & ~below & ((occupied >> kCentre & 1) - 1);
    store(certain, elements.certain + n);
    store(near & ~certain, elements.open + n);
  }
}

BACKWASH_CLONES
void decide(const Elements& elements, std::size_t count, const std::uint64_t* hidden, std::uint64_t* wall,
            std::uint64_t* corner) noexcept {
  const Words one = Words{} + 1;
  for (std::size_t n = 0; n < count; n += kEight) {
    Words up, down, with_corner, certain, open, behind;
    take_moves(elements.z + n, up, down);
    load(with_corner, elements.with_corner + n);
    load(behind, hidden + n);
    load(certain, elements.certain + n);
    load(open, elements.open + n);
    Longs wall_range;
    load_longs(wall_range, elements.wall_range + n);
    const Words seen = certain | (open & ~behind);
    store(seen >> kCentre & ((one << reinterpret_cast<Words>(wall_range + 1)) - 1), wall + n);
    store((seen << down >> up) & with_corner, corner + n);
  }
}

BACKWASH_CLONES
Inside look_inside(const std::uint64_t* words, std::size_t count, int turn, std::uint64_t band,
                   std::uint64_t* inside) noexcept {
  const auto up = static_cast<unsigned>(turn) & 63, down = (64 - up) & 63;
  Inside all{};
  for (std::size_t n = 0; n < count; ++n) inside[n] = (words[n] << up | words[n] >> down) & band;
  for (std::size_t n = 0; n < count; ++n) {
    all.some |= std::uint64_t{inside[n] != 0} << n;
    all.full |= std::uint64_t{inside[n] == band} << n;
  }
  return all;
}

namespace {

template <std::size_t kPiece>
[[gnu::always_inline]] inline void hide_by(const LineFromAbove* lines, const Hiding& hiding,
                                           std::size_t count) noexcept {
  // From y ≤ kEnds[h] · flat the last 2 voxel edges begin below the top of the voxel h.
  static const std::array<double, 2> kEnds{kHalf / std::sqrt(4 - kHalf * kHalf),
                                           (1 + kHalf) / std::sqrt(4 - (1 + kHalf) * (1 + kHalf))};
  const double end0 = kEnds[0], end1 = kEnds[1];
  for (std::size_t n = 0; n < count; n += kEight) {
    Lines line;
    gather(lines, hiding.line + n, line);
    Doubles x, y, low, high;
    load_ints(x, hiding.x + n);
    load_ints(y, hiding.y + n);
    load_ints(low, hiding.low + n);
    load_ints(high, hiding.high + n);
    x *= line.per_x;
    y *= line.per_y;
    Doubles half_x = kHalf * line.per_x, half_y = kHalf * line.per_y;
    take_size(half_x);
    take_size(half_y);
    Doubles in = x - half_x, out = x + half_x;
    take_most<kPiece>(in, y - half_y);
    take_least<kPiece>(out, y + half_y);
    take_most<kPiece>(in, Doubles{});
    take_least<kPiece>(out, line.end);
    const Doubles far = 1 / (1 - in), near = 1 / (1 - out);
    // Heights below the gap have the column in their last 2 voxel edges: a line that is longer than 2 beyond `in`.
    Doubles least = 2 * far;
    take_most<kPiece>(least, Doubles{} + (2 + kTouch));
    Doubles gap = least * least - line.flat * line.flat;
    take_most<kPiece>(gap, Doubles{});
    take_root(gap);
    gap = -gap;
    take_floor<kPiece>(gap);  // minus the gap
    const Doubles bottom = low - kHalf, top = high + kHalf;
    Doubles first, last;
    choose_less<kPiece>(Doubles{}, bottom, far, near, first);
    choose_less<kPiece>(top, Doubles{}, far, near, last);
    first *= -bottom;
    last *= top;
    Doubles level = line.flat * end0, next = line.flat * end1;
    take_floor<kPiece>(first);
    take_floor<kPiece>(last);
    take_floor<kPiece>(level);
    take_floor<kPiece>(next);
    // Of the first it is minus it.
    Doubles from_level = low, from_next = low + 1, to_level = high, to_next = high - 1, under, over;
    take_size(from_level);
    take_size(from_next);
    take_size(to_level);
    take_size(to_next);
    const Doubles half = Doubles{} + 0.5;
    choose_less<kPiece>(from_next, half, next, first, under);
    choose_less<kPiece>(to_next, half, next, last, over);
    choose_less<kPiece>(from_level, half, level, under, under);
    choose_less<kPiece>(to_level, half, level, over, over);
    take_least<kPiece>(first, under);
    take_least<kPiece>(last, over);
    Longs hidden, spared;
    take_bits<kPiece>(kCentre - first, kCentre + last, hidden);
    take_bits<kPiece>((kCentre + 1) + gap, (kCentre - 1) - gap, spared);
    Doubles word = reinterpret_cast<Doubles>(hidden & ~spared);
    choose_less<kPiece>(out, in, Doubles{}, word, word);
    store(word, hiding.hidden + n);
  }
}

struct Hide {
  template <std::size_t kPiece>
  [[gnu::always_inline]] static void run(const LineFromAbove* lines, const Hiding& hiding, std::size_t count) noexcept {
    hide_by<kPiece>(lines, hiding, count);
  }
};

}  // namespace

void hide(const LineFromAbove* lines, const Hiding& hiding, std::size_t count) noexcept {
  run_native<Hide>(lines, hiding, count);
}

BACKWASH_CLONES
void add_corner(const CornerTerms& terms, std::uint64_t heights, const float* count, CornerSums& sums) noexcept {
  // atan x over −1 ≤ x ≤ 1 to 2e-8: Abramowitz and Stegun, Handbook of Mathematical Functions, 4.4.49.
  constexpr std::array kSeries{0.0028662257F, -0.0161657367F, 0.0429096138F, -0.0752896400F,
                               0.1065626393F, -0.1420889944F, 0.1999355085F, -0.3333314528F};
  constexpr float kPi = std::numbers::pi_v<float>;
  constexpr EightFloats kSteps{0, 1, 2, 3, 4, 5, 6, 7};
  constexpr EightInts kBit{1, 2, 4, 8, 16, 32, 64, 128};
  const auto a = static_cast<float>(terms.voxel_edge), d2 = static_cast<float>(terms.d2), d = std::sqrt(d2);
  const auto phi_max = static_cast<float>(terms.phi_max);
  const float least = a * a * a * a * a * a / 64;
  while (heights) {
    const int z = std::countr_zero(heights);
    const auto at = static_cast<std::size_t>(z);
    const EightFloats h = a * (kSteps + (static_cast<float>(z - terms.floor) - 0.5F)), h2 = h * h;
    EightFloats height = h, above, below = d2 + h2 * h2 * h2, seen;
    choose_negative(h, -h, height, height);
    const EightFloats x = (d - height) / (d + height), x2 = x * x;
    EightFloats series = EightFloats{} + kSeries[0];
    for (std::size_t k = 1; k < kSeries.size(); ++k) series = series * x2 + kSeries[k];
    const EightFloats acute = (x + x * x2 * series) + kPi / 4;
    choose_negative(h, phi_max - (kPi - acute), phi_max - acute, above);
    choose_negative(above, EightFloats{}, above, above);
    choose_negative(below - least, EightFloats{} + least, below, below);
    load(seen, count + at);
    const EightInts wanted = -((EightInts{} + static_cast<std::int32_t>(heights >> z & 0xff)) & kBit) >> 31;
    seen = reinterpret_cast<EightFloats>(reinterpret_cast<EightInts>(seen * (above / below)) & wanted);
    const Doubles factor = __builtin_convertvector(seen, Doubles);
    const auto add = [&](double per_unit, std::array<double, kPadded>& to) {
      Doubles sum;
      load(sum, to.data() + at);
      sum += per_unit * factor;
      store(sum, to.data() + at);
    };
    add(terms.xx, sums.xx);
    add(terms.xy, sums.xy);
    add(terms.yy, sums.yy);
    add(terms.zz, sums.zz);
    heights = z + 8 < 64 ? heights >> (z + 8) << (z + 8) : 0;
  }
}

BACKWASH_CLONES
void sum_walls(const Walls& walls, int first, int last, int heights, Four* row, Four* sums) noexcept {
  for (int n = 0; n < walls.width; ++n) row[n] = Four{};
  for (int z = first; z <= last; ++z) {
    Four* numbers = walls.numbers + static_cast<std::ptrdiff_t>(z) * walls.width;
    Four number{};
    for (int n = 0; n < walls.width; ++n) {
      row[n] += numbers[n];
      number += row[n];
      numbers[n] = Four{};
      if (z + n < 0 || z + n >= heights) continue;
      const double step = walls.step[n];
      sums[z + n] += Four{step * number.xx, step * number.xy, step * number.yy, step * number.zz};
    }
  }
}

}  // namespace backwash::field

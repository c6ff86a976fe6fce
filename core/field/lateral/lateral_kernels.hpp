// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace backwash::field {

inline constexpr std::size_t kEight = 8;  ///< entries that the kernels take together
constexpr std::size_t padded(std::size_t count) noexcept { return (count + kEight - 1) / kEight * kEight; }

/// Lateral segments, one entry each; the arrays go on for 16 entries behind those asked for.
struct Standing {
  const std::int32_t *x, *low, *high;  ///< column, lowest and highest voxel
  const float *m_x, *m_y;              ///< normal
};
/// A column that looks along one row of columns.
struct Looking {
  int x, dy;      ///< its own x; the row lies dy rows further
  int low, high;  ///< heights of elements that may have a term
  float range2;   ///< longest line and a little, voxel edges²
};
/// Writes the numbers of those of the segments first … end − 1 that look at the column and are near enough, or nearly
/// so, to `found`, which holds 16 more; their number. Real-time: wait-free, no allocation.
std::size_t find_near(const Standing& segments, std::uint32_t first, std::uint32_t end, const Looking& looking,
                      std::uint32_t* found) noexcept;

/// Segments as seen from a column, `count` of each, rounded up to a multiple of 8.
struct Seen {
  const std::int32_t *dx, *dy;  ///< columns from the one that looks
  const double *m_x, *m_y;      ///< normal
  double *along, *flat2;        ///< r·m and |r|² from above, voxel edges
  double* decay;                ///< exp(−k2 flat2), to 1e-14
};
/// Fills along, flat2 and decay. Real-time: wait-free, no allocation.
void see(const Seen& seen, std::size_t count, double k2) noexcept;

/// One line of sight from above, from the centre of a column to an element. Voxel edges; parts of the way from the
/// column.
struct alignas(32) LineFromAbove {
  double per_x, per_y;  ///< 1/c_x, 1/c_y, where the element is at c
  double flat;          ///< its length
  double end;           ///< part of the way that is not the last 2 voxel edges, of the longest line
};
/// Lines to the elements at c_x, c_y, `range` above or below the column's voxels at most; `count` of each, rounded up
/// to a multiple of 8. Real-time: wait-free, no allocation.
void make_lines(const double* c_x, const double* c_y, const double* range, std::size_t count,
                LineFromAbove* lines) noexcept;

inline constexpr int kCentre = 31;  ///< bit of a word of heights that is an element's own
/// Lateral elements of a column of targets, one entry each. Bit kCentre of a word about an element is its own height.
struct Elements {
  const std::int32_t *z, *wall_range, *range;  ///< heights count from that of bit 0 of a word of targets; as in Reach
  const std::uint64_t* with_corner;            ///< targets that may have a corner term
  const std::uint64_t* all;                    ///< about the element: occupied in any column before it
  std::uint64_t *certain, *open;               ///< about the element
};
/// Finds the targets that see the elements for certain, and those that see it if no column hides it. `count` of each,
/// rounded up to a multiple of 8. Real-time: wait-free, no allocation.
void classify(const Elements& elements, std::size_t count, std::uint64_t targets) noexcept;

/// Heights above the elements at which they have a wall term (bit 0: level), and targets with a corner term: those
/// seen for certain, and those of `open` that nothing hides. `count` of each, rounded up to a multiple of 8. Real-time:
/// wait-free, no allocation.
void decide(const Elements& elements, std::size_t count, const std::uint64_t* hidden, std::uint64_t* wall,
            std::uint64_t* corner) noexcept;

struct Inside {
  std::uint64_t some, full;  ///< bit n: inside[n] is not 0, is the whole band
};
/// inside[n] = words[n], turned left by `turn`, within `band`, for `count` ≤ 64 words.
/// Real-time: wait-free, no allocation.
Inside look_inside(const std::uint64_t* words, std::size_t count, int turn, std::uint64_t band,
                   std::uint64_t* inside) noexcept;

/// Voxels low … high of the columns x, y that some line may cross. Heights count from the element's, columns from the
/// one that is looked from.
struct Hiding {
  const std::uint32_t* line;
  const std::int32_t *x, *y, *low, *high;
  std::uint64_t* hidden;
};
/// hidden[n]: heights from which voxels n hide the element; `count` of each, rounded up to a multiple of 8. Real-time:
/// wait-free, no allocation.
void hide(const LineFromAbove* lines, const Hiding& hiding, std::size_t count) noexcept;

/// Lateral elements of one normal and one floor as seen from a column; heights count from that of entry 0.
struct CornerTerms {
  double xx, xy, yy, zz;  ///< per unit of the factor
  double voxel_edge, d2, phi_max;
  int floor;  ///< height of the voxel under the corners
};
inline constexpr std::size_t kPadded = 72;  ///< 64 heights and one vector
struct alignas(64) CornerSums {
  std::array<double, kPadded> xx, xy, yy, zz;
};
/// sums[z] += count[z] (φ̄_c − φ)/(d_c² + h_c⁶) at the bits z of `heights`, in 72 entries. The fraction is
/// ProximityModel::corner_factor() within its gates, to 1e-6. Real-time: wait-free, no allocation.
void add_corner(const CornerTerms& terms, std::uint64_t heights, const float* count, CornerSums& sums) noexcept;

/// Four sums together.
struct alignas(32) Four {
  double xx, xy, yy, zz;
  Four& operator+=(const Four& b) noexcept {
    xx += b.xx;
    xy += b.xy;
    yy += b.yy;
    zz += b.zz;
    return *this;
  }
  Four& operator-=(const Four& b) noexcept {
    xx -= b.xx;
    xy -= b.xy;
    yy -= b.yy;
    zz -= b.zz;
    return *this;
  }
};
/// Rows of `width` numbers, one row per height of elements, one number per height above them. What is added from an
/// entry on counts for all further rows and heights. Adds step[n] · number to sums[z + n] for the rows first … last and
/// clears them; sums are those of `heights` heights from 0. `row`: width of them, for use here. Real-time: wait-free,
/// no allocation.
struct Walls {
  Four* numbers;  ///< of row 0
  int width;
  const double* step;
};
void sum_walls(const Walls& walls, int first, int last, int heights, Four* row, Four* sums) noexcept;

}  // namespace backwash::field

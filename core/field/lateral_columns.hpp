// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/field/proximity_model.hpp"
#include "core/field/sight.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/types/model.hpp"

namespace backwash::field {

/// Corner and wall terms (docs/model.md section 2) in whole columns of voxel centres at once.
///
/// Lateral elements that stand on top of each other with one normal and one floor form a segment. Seen from the voxel
/// centres of one column, all of them lie behind the same horizontal line, over the same columns of voxels: where these
/// have a stretch of heights free of occupied voxels in common, every voxel centre of the stretch sees every element of
/// it, and the wall terms are differences of a running sum of exp(−k_w2 a² n²) over the height n. What is left is
/// decided exactly, for 64 heights at once.
class LateralColumns {
 public:
  /// `grid` must outlive this. O(cells).
  LateralColumns(const map::OccupancyGrid& grid, const Model& model);

  static constexpr int kLayers = 64;
  /// Sums at the centres of a column's voxels, (m/s²)²; entry z belongs to layer first.z() + z.
  struct Sums {
    std::array<double, kLayers> xx, xy, yy, zz;
  };

 private:
  friend class LateralSweep;

  struct Tensor {
    double xx, xy, yy, zz;
  };
  struct Segment {
    int x, low, high;     ///< voxels low … high of the column
    int floor;            ///< voxel under the corners; kNoFloor: no corner
    int normal;           ///< number of the normal if it is frequent, else −1
    double m_x, m_y;      ///< unit normal
    Tensor wall, corner;  ///< per unit of the factors of ProximityModel
  };
  /// Heights z, below < z < above, are free of occupied voxels about a voxel; none if it is occupied.
  struct Stretch {
    std::int16_t below, above;
  };
  static constexpr int kNoFloor = -1;
  static constexpr int kFrequent = 16;

  void add_segments();
  void number_normals();
  void add_columns();
  void add_tables();
  std::size_t column(int x, int y) const noexcept {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(grid_->size().x()) + static_cast<std::size_t>(x);
  }
  /// Occupied voxels of the layers z … z + 63 of a column, −64 ≤ z ≤ layers.
  std::uint64_t occupied(std::size_t column, int z) const noexcept {
    const auto at = static_cast<std::size_t>(z + 64);
    const std::uint64_t* word = bits_.data() + column * words_ + at / 64;
    const auto shift = static_cast<unsigned>(at % 64);
    return word[0] >> shift | (shift ? word[1] << (64 - shift) : 0);
  }

  const map::OccupancyGrid* grid_;
  Model model_;
  ProximityModel terms_;
  SightMap sight_;                 ///< for boxes of empty voxels
  double range2_;                  ///< (l̄_w/a)² and a little, voxel edges²
  int radius_;                     ///< of the columns' surroundings, voxels
  std::vector<Segment> segments_;  ///< row by row, then by x, then by normal, then by height
  std::vector<std::uint32_t> row_first_;
  std::vector<Stretch> stretches_;            ///< per voxel of the grid
  std::size_t words_;                         ///< of bits_ per column, 64 empty layers before the first
  std::vector<std::uint64_t> bits_;           ///< occupied voxels
  std::vector<double> decay_;                 ///< [n]: Σ exp(−k_w2 a² i²) over i < n
  std::vector<double> wall_low_, wall_high_;  ///< limits of d_c² for the wall term n voxels below, m²
  std::vector<double> arc_;                   ///< π/4 + atan x over −1 ≤ x ≤ 1
};

/// Evaluates columns one after the other; keeps the lines that many of them share.
class LateralSweep {
 public:
  explicit LateralSweep(const LateralColumns& columns);
  /// Adds the terms in the voxels of column (x, y) that `targets` marks: bit z is layer first_z + z. Entries of `sums`
  /// outside them hold nothing. Bits do not depend on what was evaluated before.
  void add(int x, int y, int first_z, std::uint64_t targets, LateralColumns::Sums& sums);

 private:
  using Segment = LateralColumns::Segment;
  /// A column of voxels that the line of sight passes: closed boxes, part t_in … t_out of the way to the element.
  struct Crossing {
    int dx, dy;
    std::ptrdiff_t column;
    double t_in, t_out;
  };
  /// What all pairs of a voxel in the column at 0 and an element at the offset (dx, dy) have in common.
  struct Line {
    double d2;                                             ///< d_c², m²
    double flat2;                                          ///< the same, voxel edges²
    int range;                                             ///< |z_e − z_q| at most, voxels: the gate |r| ≤ l̄_w
    int wall_range;                                        ///< z_q − z_e at most for the wall term; −1: none
    double decay;                                          ///< exp(−k_w2 d_c²)
    int corner_low;                                        ///< height above the floor voxel of corner[0] …
    std::vector<double> corner;                            ///< … (φ̄_c − φ)/(d_c² + h_c⁶)
    std::vector<Crossing> crossings;                       ///< with rising t_in
    bool made = false, in_range = false, crossed = false;  ///< crossed: `crossings` made
  };
  /// The column in hand.
  struct View {
    int x, y, first_z;
    std::uint64_t targets;
    int low, high;  ///< layers of the map that hold targets
  };

  Line& line(const Segment& segment, int dx, int dy);
  void make(Line& line, const Segment& segment, int dx, int dy) const;
  void add_corner(Line& line) const;
  void add_crossings(Line& line, double c_x, double c_y, int dx, int dy) const;
  void add(const View& view, const Segment& segment, int dy, LateralColumns::Sums& sums);
  bool surely_clear(const View& view, const Segment& segment, const Line& line, int dx, int dy) const noexcept;
  LateralColumns::Stretch common_stretch(const View& view, const Line& line, int z) const noexcept;
  void add_uncertain(const View& view, const Segment& segment, const Line& line,
                     const LateralColumns::Stretch& stretch);
  std::uint64_t blocked(const View& view, const Line& line, int dz, std::uint64_t lanes) const noexcept;

  const LateralColumns& columns_;
  int width_;
  std::vector<Line> lines_;  ///< per frequent normal and offset
  Line other_;               ///< the last line of another normal
  std::vector<Crossing> active_;
  std::array<double, LateralColumns::kLayers> wall_{}, seen_{};  ///< per layer: Σ exp(−k_w2 a² n²), number of elements
};

}  // namespace backwash::field

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/field/proximity_model.hpp"
#include "core/field/sight.hpp"
#include "core/field/sight_lines.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/types/model.hpp"

namespace backwash::field {

/// Corner and wall terms (docs/model.md section 2) in whole columns of voxel centres at once.
///
/// Lateral elements that stand on top of each other with one normal and one floor form a segment. Seen from the voxel
/// centres of one column, all of them lie behind the same horizontal line, over the same columns of voxels: where these
/// have a stretch of heights free of occupied voxels in common, every voxel centre of the stretch sees every element of
/// it, and the wall terms are differences of a running sum of exp(−k_w2 a² n²) over the height n. What is left is
/// decided element by element, for all heights at once. The columns to look at come from a table by offset and sector
/// of normals, so that its size, and the cost, do not grow with the number of normals.
class LateralColumns {
 public:
  /// `grid` must outlive this. O(cells + a⁻³).
  LateralColumns(const map::OccupancyGrid& grid, const Model& model);

  static constexpr int kLayers = 64;
  /// Sums at the centres of a column's voxels, (m/s²)²; entry z belongs to layer first.z() + z.
  struct Sums {
    std::array<double, kLayers> xx, xy, yy, zz;
  };

 private:
  friend class LateralSweep;

  struct Tensor {
    float xx, xy, yy, zz;
  };
  /// 64 bytes, a line of the cache: absence is a number and no optional.
  struct ElementSegment {
    double m_x, m_y;      ///< unit normal
    Tensor wall, corner;  ///< per unit of the factors of ProximityModel
    int x, y;
    std::int16_t low, high;  ///< voxels low … high of the column
    std::int16_t floor;      ///< voxel under the corners; kNoFloor: no corner
    std::int16_t bundle;     ///< of its normal, in lines_
  };
  static constexpr int kNoFloor = -1;
  static constexpr int kSectors = 8;  ///< of the circle: the normals of each are a bundle
  static constexpr int kWindow = 64;  ///< most columns along x in a block

  void add_segments();
  std::vector<SightLines::Bundle> bundle_normals();
  void add_tables();

  const map::OccupancyGrid* grid_;
  Model model_;
  ProximityModel terms_;
  SightMap sight_;                           ///< for lines beyond the window
  double range2_;                            ///< (l̄_w/a)² and a little, voxel edges²
  int radius_;                               ///< of the columns' surroundings, voxels
  int pitch_;                                ///< columns in a row of a block's window
  std::vector<ElementSegment> segments_;     ///< row by row, then by x, sector, normal and height
  std::vector<std::uint32_t> column_first_;  ///< of the segments, per column
  SightLines lines_;
  std::vector<double> decay_;  ///< [n]: Σ exp(−k_w2 a² i²) over i < n, in multiples of 2⁻⁴⁰: sums are exact
  std::vector<double> step_;   ///< [kLayers + n]: exp(−k_w2 a² n²), the same; 0 for n < 0 or beyond the range
  std::vector<double> wall_low_, wall_high_;  ///< limits of d_c² for the wall term n voxels below, m²
  struct Reach {
    int range;       ///< |z_e − z_q| at most, voxels: the gate |r| ≤ l̄_w
    int wall_range;  ///< z_q − z_e at most for the wall term; −1: no height is within
  };
  /// The largest heights that the gates allow at the horizontal distance (d_c/a)² = flat2.
  Reach reach_of(double flat2) const noexcept {
    const double a2 = grid_->resolution() * grid_->resolution(), d2 = a2 * flat2;
    const auto n = static_cast<std::size_t>(flat2);
    Reach reach = n < least_reach_.size() ? least_reach_[n] : Reach{-1, -1};
    while (terms_.in_wall_range(d2 + a2 * (reach.range + 1) * (reach.range + 1))) ++reach.range;
    const auto in_gate = [&](int up) {
      const auto at = static_cast<std::size_t>(up);
      return at < wall_low_.size() && d2 >= wall_low_[at] && d2 <= wall_high_[at];
    };
    while (in_gate(reach.wall_range + 1)) ++reach.wall_range;
    return reach;
  }
  std::vector<Reach> least_reach_;  ///< [n]: what reach_of() is at least, n ≤ (d_c/a)² < n + 1
  double cot_phi_max_;              ///< 0 if φ̄_c is not less than π/2
};

}  // namespace backwash::field

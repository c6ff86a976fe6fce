// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/field/proximity_model.hpp"
#include "core/field/sight/sight.hpp"
#include "core/field/sight/sight_lines.hpp"
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
  template <typename Word>
  friend class LateralSweep;
  friend class LateralSums;
  friend struct NearSegments;

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
  void add_arrays();
  void add_tables();

  const map::OccupancyGrid* grid_;
  Model model_;
  ProximityModel terms_;
  std::optional<SightMap> sight_;             ///< for lines beyond a word, where there may be such
  double range2_;                             ///< (l̄_w/a)² and a little, voxel edges²
  int radius_;                                ///< of the columns' surroundings, voxels
  int pitch_;                                 ///< columns in a row of a block's window
  std::vector<ElementSegment> segments_;      ///< row by row, then by x, sector, normal and height
  std::vector<std::uint32_t> column_first_;   ///< of the segments, per column
  std::vector<std::int32_t> x_, low_, high_;  ///< of the segments: for find_near()
  std::vector<float> m_x_, m_y_;
  SightLines lines_;
  std::vector<std::int32_t> places_;  ///< of the lines' crossings, from the column that is looked from, in a window
  struct Reach {
    std::int16_t range;              ///< |z_e − z_q| at most, voxels: the gate |r| ≤ l̄_w; −1: never
    std::int16_t wall_range;         ///< z_q − z_e at most for the wall term; −1: never
    std::int16_t first_up, last_up;  ///< heights above the floor's voxel at which the corner's factor may not be zero
    bool operator==(const Reach&) const = default;
  };
  /// What the gates leave at the horizontal distance (d_c/a)² = flat2.
  Reach reach_of(double flat2) const noexcept {
    const auto n = static_cast<std::size_t>(flat2 * kCells);
    const Cell cell = n < reaches_.size() ? reaches_[n] : Cell{};
    return cell.same ? cell.reach : exact_reach(flat2);
  }
  Reach exact_reach(double flat2) const noexcept;
  Reach bounds_of(double flat2) const noexcept;
  static constexpr double kCells = 4;  ///< per voxel edge²
  struct Cell {
    Reach reach{};
    bool same = false;  ///< for all flat2 of the cell
  };
  std::vector<Cell> reaches_;
  std::vector<double> wall_low_;  ///< [n]: least d_c² for the wall term n voxels below, m²
  std::vector<double> step_;      ///< [n]: exp(−k_w2 a² n²)
  /// [n]: bits of a word about an element that a line may cross from n layers below and above, by the part that is
  /// left.
  std::vector<std::array<std::uint64_t, SightLines::kParts>> below_, above_;
  std::vector<int> half_width_;  ///< [|dy|]: columns on either side in a row dy away that are near enough
  double corner_l2_;             ///< (l̄_c/a)² and a little, voxel edges²
  double cot_phi_max_;           ///< 0 if φ̄_c is not less than π/2
};

}  // namespace backwash::field

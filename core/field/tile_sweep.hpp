// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "core/field/whole_field.hpp"

namespace backwash::field {

/// Evaluates tiles one after the other, with a window onto the surroundings of their column: at each position within
/// the stencils' radius, the words (bit x' + 8 y': voxel (x + x', y + y')) of all layers, z running fastest.
class TileSweep {
  using Tile = WholeField::Tile;
  using Lanes = WholeField::Lanes;
  using Term = WholeField::Term;
  using Offset = WholeField::Stencil::Offset;
  using Gates = WholeField::Stencil::Gates;

 public:
  explicit TileSweep(const WholeField& whole)
      : whole_(whole),
        grid_(*whole.grid_),
        layers_(static_cast<std::size_t>(grid_.size().z())),
        positions_(static_cast<std::size_t>(whole.width_) * static_cast<std::size_t>(whole.width_)),
        occupied_(layers_ * positions_ + kBlock),
        scratch_(layers_ * positions_),
        scratch_floors_(layers_ * positions_, kNoFloors),
        row_bytes_(static_cast<std::size_t>(whole.width_)),
        row_floors_(static_cast<std::size_t>(whole.width_), kNoFloors),
        touched_(positions_) {
    for (int lane = 0; lane < 64; ++lane)
      lane_step_[static_cast<std::size_t>(lane)] =
          whole.column_place(Index3(lane % 8, lane / 8, 0)) - whole.column_place(Index3::Zero());
  }

  void run(const Tile& tile) {
    if (tile.first.head<2>() != corner_) open_window(tile.first);
    tile_ = tile;
    std::fill(sum_.begin() + 64 * tile.low, sum_.begin() + 64 * (tile.high + 1), Term{});
    uniform_.fill({});
    for (std::size_t kind = 0; kind < WholeField::kClasses; ++kind)
      for (const Column& column : columns_[kind]) evaluate(kind, column);
  }

  Variance sigma(std::size_t z, unsigned lane) const noexcept {
    const Term &s = sum_[64 * z + lane], &u = uniform_[z];
    const auto& base = whole_.model_.base;
    return {base.horizontal + u.xx + s.xx, u.xy + s.xy, 0,
            base.horizontal + u.yy + s.yy, 0,           base.vertical + u.zz + s.zz};
  }

 private:
  static constexpr std::size_t kBlock = 4;  // layers; words past a view's last layer are read, and must be empty
  /// Lowest and highest of the floors under some elements' corners.
  struct Floors {
    std::int16_t low, high;
    void take(std::int16_t floor) noexcept { take({floor, floor}); }
    void take(const Floors& o) noexcept { low = std::min(low, o.low), high = std::max(high, o.high); }
  };
  static constexpr Floors kNoFloors{INT16_MAX, INT16_MIN};
  /// The elements of one class at one position: words of the layers low … high.
  struct Column {
    std::uint32_t position;
    int low, high;
    Floors floors;
    std::size_t first;  // of words_ and floors_: that of layer `low`
  };
  /// What one offset sees: elements seen from each layer of the tile; none outside low … high.
  struct View {
    const Gates* gates;
    const Floors* floors;   // of the elements seen from layer `low`; others follow
    std::size_t low, high;  // layers of the tile
  };

  template <typename Visit>
  static void for_each_lane(std::uint64_t lanes, const Visit& visit) {
    for (; lanes; lanes &= lanes - 1) visit(static_cast<unsigned>(std::countr_zero(lanes)));
  }
  static void add(Term& sum, const Term& t, double factor) noexcept {
    sum.xx += factor * t.xx, sum.xy += factor * t.xy, sum.yy += factor * t.yy, sum.zz += factor * t.zz;
  }

  static void add(Term& sum, const std::array<float, 4>& t, double factor) noexcept {
    sum.xx += factor * t[0], sum.xy += factor * t[1], sum.yy += factor * t[2], sum.zz += factor * t[3];
  }

  void open_window(const Index3& first);
  void open_occupied();
  void open_columns(std::size_t kind);
  void scatter(std::size_t kind, int y, int z);
  void evaluate(std::size_t kind, const Column& column);
  /// Whether an element with a floor within limits may have a corner term in a layer of the map.
  static bool may_have_corner(const Gates& gates, const Floors& floors, int z) noexcept {
    return floors.high != WholeField::kNoFloor && z - floors.high <= gates.corner_high &&
           z - std::max<int>(floors.low, 0) >= gates.corner_low;
  }
  void ground(const Offset& offset, const View& view);
  void axis(std::size_t kind, const Offset& offset, const View& view);
  void turned(std::size_t kind, const Offset& offset, const View& view);
  bool hidden(std::size_t kind, const Offset& offset, const Gates& gates, const WholeField::Turned& element,
              std::size_t z, unsigned lane) const;

  /// The words of the tile in occupied_.
  const std::uint64_t* here() const noexcept {
    return occupied_.data() + positions_ / 2 * layers_ + static_cast<std::size_t>(tile_.first.z());
  }
  /// Puts the lanes whose path meets no occupied voxel into clear_: the layers of a block together, in registers.
  void clear(const std::vector<std::int32_t>& steps, const View& view) noexcept {
    const std::int32_t* const begin = steps.data() + view.gates->first;
    const std::int32_t* const end = steps.data() + view.gates->last;
    std::size_t z = view.low;
    for (; z + 1 <= view.high; z += kBlock) clear_block<kBlock>(begin, end, z);
    if (z == view.high) clear_block<1>(begin, end, z);
  }
  template <std::size_t count>
  void clear_block(const std::int32_t* step, const std::int32_t* end, std::size_t z) noexcept {
    const std::uint64_t* words = here() + z;
    std::array<std::uint64_t, count> left;
    std::copy_n(lanes_.begin() + static_cast<std::ptrdiff_t>(z), count, left.begin());
    const auto meet = [&](const std::uint64_t* word) {
      for (std::size_t n = 0; n < count; ++n) left[n] &= ~word[n];
    };
    for (; end - step >= 4; step += 4) {
      for (int n = 0; n < 4; ++n) meet(words + step[n]);
      std::uint64_t any = 0;
      for (const std::uint64_t word : left) any |= word;
      if (!any) break;
    }
    if (end - step < 4)
      for (; step != end; ++step) meet(words + *step);
    std::copy_n(left.begin(), count, clear_.begin() + static_cast<std::ptrdiff_t>(z));
  }
  const WholeField& whole_;
  const map::OccupancyGrid& grid_;
  std::size_t layers_, positions_;
  Eigen::Vector2i corner_{-1, -1};  // of the window's middle, voxels
  std::vector<std::uint64_t> occupied_;
  std::array<std::vector<Column>, WholeField::kClasses> columns_;
  std::vector<std::uint64_t> words_;          // of the columns
  std::vector<Floors> floors_;                // the same
  std::vector<std::uint64_t> scratch_;        // of the columns while they are made; zero between
  std::vector<Floors> scratch_floors_;        // the same
  std::vector<std::uint64_t> row_bytes_;      // the same
  std::vector<Floors> row_floors_;            // the same
  std::array<std::ptrdiff_t, 64> lane_step_;  // in column_place
  std::vector<std::uint32_t> touched_;        // per position: 1 + its column, 0: none yet
  Tile tile_{};
  std::array<std::uint64_t, WholeField::kLayers + kBlock> lanes_{},
      clear_{};  // of the offset in hand: elements, and those whose path is clear; between the view's limits
  std::array<Term, 64 * WholeField::kLayers> sum_;
  std::array<Term, WholeField::kLayers> uniform_;  // what all voxels of a layer have in common
};

}  // namespace backwash::field

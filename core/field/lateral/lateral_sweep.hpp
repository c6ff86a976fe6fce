// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/field/lateral/lateral_columns.hpp"
#include "core/field/lateral/lateral_kernels.hpp"
#include "core/field/lateral/lateral_sums.hpp"
#include "core/field/lateral/layers.hpp"
#include "core/field/lateral/near_segments.hpp"
#include "core/field/sight/hiding_runs.hpp"
#include "core/field/sight/sight_lines.hpp"

namespace backwash::field {

/// Evaluates LateralColumns column after column of a block, from a window of its surroundings. `Word`: the occupied
/// layers of a column, std::uint64_t for a map of no more than 64 layers and Layers for any.
///
/// Each column of targets takes these steps, each for all segments in range: which are near (kernels), which heights
/// the gates leave, what is seen for certain, which crossed columns may hide the rest, what they hide (kernels), sums
/// (kernels).
template <typename Word>
class LateralSweep {
 public:
  explicit LateralSweep(const LateralColumns& columns);
  /// Takes the columns x … x + LateralColumns::kWindow − 1, y … y + height − 1 in hand, and the layers first_z …
  /// first_z + LateralColumns::kLayers − 1.
  void open(int x, int y, int height, int first_z);
  /// Sums of the terms in the voxels of column (x, y) of the block that `targets` marks: bit z is layer first_z + z.
  /// Other entries hold nothing. Bits do not depend on what was evaluated before.
  const LateralColumns::Sums& sum(int x, int y, std::uint64_t targets);

 private:
  using ElementSegment = LateralColumns::ElementSegment;
  static constexpr int kBelow = sizeof(Word) == 8 ? 0 : 32;  ///< bit n of a column is layer first_z − kBelow + n
  /// A segment in range as seen from the column in hand; heights count from first_z.
  struct View : LateralColumns::Reach {
    const ElementSegment* segment;
    std::uint32_t near;           ///< number in near_
    std::uint64_t with_corner;    ///< targets that may have a corner term
    std::uint32_t words;          ///< first of words_, of the columns that its lines cross
    std::uint16_t crossed, must;  ///< how many, and how many that every line crosses
    std::uint32_t crossings;      ///< first of them in the table
    std::uint32_t element, end;   ///< of its elements below
    std::int16_t from, to;        ///< elements that every target sees; none if from > to
  };

  void reserve_views(std::size_t most);
  void open_view(std::uint32_t near);
  Word look_along(const SightLines::Line& line);
  void add_stack(View& view, const Word& all);
  void add_element(const View& view, int z, const Word& all);
  std::uint64_t around(const Word& word, int z) const noexcept;
  std::uint64_t looked_at(const View& view, int z, std::uint64_t targets) const noexcept;
  void find_hiding();
  void look_between(std::uint32_t element);
  const std::uint64_t* about(const View& view, int z);
  void add_walls();
  void add_corners();
  std::uint64_t count_stack(const View& view) noexcept;

  const LateralColumns& columns_;
  int first_x_ = 0, first_y_ = 0, first_z_ = 0;  ///< of the window and the layers
  int x_ = 0, y_ = 0;                            ///< the column in hand
  std::uint64_t targets_ = 0;
  const Word* home_ = nullptr;  ///< the same, in the window
  std::vector<Word> window_;    ///< occupied voxels

  NearSegments near_;
  std::size_t view_count_ = 0;
  std::vector<View> views_;
  std::vector<double> c_x_, c_y_, range_;  ///< of the views
  std::vector<LineFromAbove> lines_;
  const SightLines::Line* line_ = nullptr;  ///< looked along last
  Word all_ = 0;                            ///< what is occupied in any of the columns there
  std::vector<Word> words_;                 ///< what is occupied in each
  std::size_t word_count_ = 0;
  std::vector<std::uint64_t> about_, inside_;  ///< of one element: words about it, and between its targets and it

  std::size_t element_count_ = 0;
  std::vector<std::uint32_t> view_of_, open_elements_;
  std::vector<std::int32_t> z_, wall_range_, reach_;
  std::vector<std::uint64_t> with_corner_, all_about_, certain_, open_, far_, hidden_, wall_, corner_;

  HidingRuns hiding_;
  LateralSums totals_;
  std::array<float, kPadded> count_{}, ones_{};
  LateralColumns::Sums sums_{};
};

}  // namespace backwash::field

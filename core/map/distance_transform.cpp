// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/distance_transform.hpp"

#include <algorithm>
#include <vector>

namespace backwash::map {
namespace {

// A voxel n steps away has its face 2n − 1 half voxels from the centre. Squares are integers below 2²⁴, exact in float.
using Square = float;
constexpr int kMostSteps = 128;
constexpr auto kFar = static_cast<Square>(kFarthestSquared);
constexpr std::size_t kChunk = 64;  // voxels whose search ends together

/// The steps to the nearest obstacle of the layer below or above, one more where a voxel is free.
void step_on(const Cell* cells, const std::uint8_t* before, std::uint8_t* steps, std::size_t count) noexcept {
  for (std::size_t n = 0; n < count; ++n) {
    const auto next = static_cast<std::uint8_t>(std::min<int>(before[n], kMostSteps) + 1);
    steps[n] = cells[n] == Cell::free ? next : 0;
  }
}

void take_squares(const std::uint8_t* below, const std::uint8_t* above, Square* squares, std::size_t count) noexcept {
  for (std::size_t n = 0; n < count; ++n) {
    const int half_voxels = std::max(0, 2 * std::min<int>(below[n], above[n]) - 1);
    squares[n] = static_cast<Square>(std::min<int>(half_voxels * half_voxels, kFarthestSquared));
  }
}

/// Lowers out[n] to the least of a and b there plus a square; the largest of what comes out.
Square lower(Square* out, const Square* a, const Square* b, Square square, std::size_t count) noexcept {
  Square largest = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const Square nearer = a[n] < b[n] ? a[n] : b[n];
    const Square found = nearer + square;
    const Square least = found < out[n] ? found : out[n];
    out[n] = least;
    largest = largest < least ? least : largest;
  }
  return largest;
}

void store(const Square* squares, std::uint16_t* stored, std::size_t count) noexcept {
  for (std::size_t n = 0; n < count; ++n) stored[n] = static_cast<std::uint16_t>(static_cast<int>(squares[n]));
}

/// Work space over a box and what lies `most_` voxels around it within the grid, where all that matters is.
class Transform {
 public:
  Transform(const OccupancyGrid& grid, const VoxelBox& box)
      : grid_(grid),
        box_(box),
        most_(most_steps(grid.size())),
        low_((box.low - Index3::Constant(most_)).cwiseMax(0)),
        end_((box.high + Index3::Constant(most_ + 1)).cwiseMin(grid.size())),
        width_(static_cast<std::size_t>(end_.x() - low_.x())),
        rows_(static_cast<std::size_t>(end_.y() - low_.y())),
        none_(width_, 0),
        far_(width_, kFar),
        squares_(width_ * rows_),
        least_of_row_(rows_),
        pad_(static_cast<std::size_t>(most_)),
        line_(width_ + 2 * pad_) {
    std::fill_n(line_.begin(), pad_, low_.x() == 0 ? 0 : kFar);
    std::fill_n(line_.rbegin(), pad_, end_.x() == grid.size().x() ? 0 : kFar);
  }

  void run(SharedRows<std::uint16_t>& squared) {
    const std::size_t layer = width_ * rows_, layers = static_cast<std::size_t>(end_.z() - low_.z());
    std::vector<std::uint8_t> above(layer * (layers + 1), end_.z() == grid_.size().z() ? 0 : kMostSteps + 1);
    for (int k = end_.z(); k-- > low_.z();) step(k, &above[layer * at(2, k + 1)], &above[layer * at(2, k)]);
    std::vector<std::uint8_t> below(layer, low_.z() == 0 ? 0 : kMostSteps + 1);
    for (int k = low_.z(); k <= box_.high.z(); ++k) {
      step(k, below.data(), below.data());
      if (k < box_.low.z()) continue;
      take_squares(below.data(), &above[layer * at(2, k)], squares_.data(), layer);
      for (std::size_t j = 0; j < rows_; ++j)
        least_of_row_[j] = *std::min_element(&squares_[j * width_], &squares_[j * width_] + width_);
      for (int j = box_.low.y(); j <= box_.high.y(); ++j) {
        along_y(j);
        along_x();
        store(&out_[pad_ + at(0, box_.low.x())], squared.own_row(j, k) + box_.low.x(),
              static_cast<std::size_t>(box_.high.x() - box_.low.x() + 1));
      }
    }
  }

 private:
  std::size_t at(int axis, int index) const noexcept { return static_cast<std::size_t>(index - low_[axis]); }
  void step(int k, const std::uint8_t* before, std::uint8_t* steps) const noexcept {
    for (std::size_t j = 0; j < rows_; ++j) {
      const Index3 first(low_.x(), low_.y() + static_cast<int>(j), k);
      step_on(&grid_.cells()[grid_.linear(first)], before + j * width_, steps + j * width_, width_);
    }
  }
  /// Squares of a row, of the outside, or of what is too far to matter.
  const Square* row(int j) const noexcept {
    if (j < 0 || j >= grid_.size().y()) return none_.data();
    return j < low_.y() || j >= end_.y() ? far_.data() : &squares_[width_ * at(1, j)];
  }
  Square least_of_row(int j) const noexcept {
    if (j < 0 || j >= grid_.size().y()) return 0;
    return j < low_.y() || j >= end_.y() ? kFar : least_of_row_[at(1, j)];
  }
  /// Lowers a chunk step by step by what stands on both sides, `least` at least, until nothing there can be nearer.
  template <class Side, class Least>
  void lower_chunk(Square* out, std::size_t count, const Side& side, const Least& least) const noexcept {
    Square largest = *std::max_element(out, out + count);
    for (int d = 1; d <= most_; ++d) {
      const auto square = static_cast<Square>((2 * d - 1) * (2 * d - 1));
      if (square >= largest) return;
      if (square + least(d) < largest) largest = lower(out, side(-d), side(d), square, count);
    }
  }
  /// Into the middle of line_, between what lies left and right of it.
  void along_y(int j) {
    std::copy_n(row(j), width_, &line_[pad_]);
    for (std::size_t x = 0; x < width_; x += kChunk)
      lower_chunk(
          &line_[pad_ + x], std::min(kChunk, width_ - x), [&](int d) { return row(j + d) + x; },
          [&](int d) { return std::min(least_of_row(j - d), least_of_row(j + d)); });
  }
  /// From line_ into out_.
  void along_x() {
    out_ = line_;
    const Square least = *std::min_element(&line_[pad_], &line_[pad_] + width_);
    for (std::size_t x = 0; x < width_; x += kChunk) {
      const std::size_t count = std::min(kChunk, width_ - x);
      const auto to_side = static_cast<int>(std::min(x, width_ - x - count));
      lower_chunk(
          &out_[pad_ + x], count, [&](int d) { return &line_[pad_ + x] + d; },
          [&](int d) { return d > to_side ? 0 : least; });
    }
  }

  const OccupancyGrid& grid_;
  VoxelBox box_;
  int most_;
  Index3 low_, end_;
  std::size_t width_, rows_;
  std::vector<Square> none_, far_, squares_, least_of_row_;
  std::size_t pad_;
  std::vector<Square> line_, out_;
};

}  // namespace

int most_steps(const Index3& size) noexcept { return std::min(kMostSteps, (size.minCoeff() + 1) / 2); }

void transform_distances(const OccupancyGrid& grid, const VoxelBox& box, SharedRows<std::uint16_t>& squared) {
  Transform(grid, box).run(squared);
}

}  // namespace backwash::map

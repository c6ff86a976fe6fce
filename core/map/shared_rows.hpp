// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "core/map/lattice.hpp"
#include "core/map/voxel_box.hpp"

namespace backwash::map {

/// Cells of a grid, one for each voxel, by rows along x: a row is one piece of memory. Rows stand in blocks that copies
/// share, so that snapshots of a map that changed in one place hold the rest once. What is shared is never written:
/// own() comes first.
template <class Cell>
class SharedRows {
 public:
  /// `size`: voxels along x, y, z, > 0.
  explicit SharedRows(const Index3& size, Cell fill = {}) : size_(size) {
    constexpr std::size_t kCells = 4096;  // of a block at least: the pointers of all blocks stay in the cache
    while ((width() << shift_) < kCells && (std::size_t{1} << shift_) < rows()) ++shift_;
    blocks_.resize(((rows() - 1) >> shift_) + 1);
    for (std::size_t n = 0; n < blocks_.size(); ++n) {
      blocks_[n] = std::make_shared<Cell[]>(cells_of(n));
      std::fill_n(blocks_[n].get(), cells_of(n), fill);
    }
  }

  const Index3& size() const noexcept { return size_; }
  /// The cells of the row at y = j, z = k. Precondition: it is in the grid. Real-time: wait-free, no allocation.
  const Cell* row(int j, int k) const noexcept { return at(j, k); }
  /// Precondition: inside the grid. Real-time: wait-free, no allocation.
  Cell operator[](const Index3& v) const noexcept { return at(v.y(), v.z())[v.x()]; }

  /// Copies what is shared of the rows that a box inside the grid meets: they may be written from now on, until a copy
  /// of this is made.
  void own(const VoxelBox& box) {
    std::size_t last = blocks_.size();
    for (int k = box.low.z(); k <= box.high.z(); ++k)
      for (std::size_t n = number(box.low.y(), k) >> shift_; n <= number(box.high.y(), k) >> shift_; ++n) {
        if (n == last) continue;
        auto fresh = std::make_shared<Cell[]>(cells_of(n));
        std::copy_n(blocks_[n].get(), cells_of(n), fresh.get());
        blocks_[n] = std::move(fresh);
        last = n;
      }
  }
  /// The same row to be written. Precondition: own() of it, or no copy was made yet.
  Cell* own_row(int j, int k) noexcept { return at(j, k); }

 private:
  std::size_t width() const noexcept { return static_cast<std::size_t>(size_.x()); }
  std::size_t rows() const noexcept {
    return static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(size_.z());
  }
  std::size_t number(int j, int k) const noexcept {
    return static_cast<std::size_t>(j) + static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(k);
  }
  std::size_t cells_of(std::size_t block) const noexcept {
    const std::size_t first = block << shift_;
    return width() * std::min(std::size_t{1} << shift_, rows() - first);
  }
  Cell* at(int j, int k) const noexcept {
    const std::size_t n = number(j, k), within = n & ((std::size_t{1} << shift_) - 1);
    return blocks_[n >> shift_].get() + within * width();
  }

  Index3 size_;
  int shift_ = 0;  // 2^shift_ rows a block
  std::vector<std::shared_ptr<Cell[]>> blocks_;
};

}  // namespace backwash::map

// SPDX-License-Identifier: BSD-3-Clause
// TileSweep's window: opened once for all tiles of a column.
#include <algorithm>
#include <utility>

#include "core/field/tile_sweep.hpp"

namespace backwash::field {

void TileSweep::open_window(const Index3& first) {
  corner_ = first.head<2>();
  open_occupied();
  words_.clear(), floors_.clear();
  for (std::size_t kind = 0; kind < WholeField::kClasses; ++kind) open_columns(kind);
}

/// Slides a byte along each row of voxels, and spreads it over the eight positions along y that hold it.
void TileSweep::open_occupied() {
  const int width = whole_.width_, x0 = corner_.x() - whole_.radius_, y0 = corner_.y() - whole_.radius_;
  std::ranges::fill(occupied_, 0);
  for (int z = 0; z < grid_.size().z(); ++z)
    for (int y = std::max(0, y0); y < std::min(grid_.size().y(), y0 + width + 7); ++y) {
      const std::size_t start = grid_.linear(Index3(0, y, z));
      const auto bit = [&](int x) -> std::uint64_t {
        if (x < 0 || x >= grid_.size().x()) return 0;
        return grid_.at(start + static_cast<std::size_t>(x)) == map::Cell::occupied ? 0x80 : 0;
      };
      std::uint64_t byte = 0;
      for (int x = x0; x < x0 + 7; ++x) byte = byte >> 1 | bit(x);
      const int row = y - y0, first = std::max(0, row - 7), last = std::min(width - 1, row);
      for (int column = 0; column < width; ++column) {
        byte = byte >> 1 | bit(x0 + column + 7);
        if (!byte) continue;
        for (int wy = first; wy <= last; ++wy)
          occupied_[static_cast<std::size_t>(wy * width + column) * layers_ + static_cast<std::size_t>(z)] |=
              byte << 8 * (row - wy);
      }
    }
}

void TileSweep::open_columns(std::size_t kind) {
  columns_[kind].clear();
  const int y0 = corner_.y() - whole_.radius_;
  for (int z = 0; z < grid_.size().z(); ++z)
    for (int y = std::max(0, y0); y < std::min(grid_.size().y(), y0 + whole_.width_ + 7); ++y) scatter(kind, y, z);
  std::ranges::sort(columns_[kind], {}, &Column::position);
  for (Column& column : columns_[kind]) {
    column.first = words_.size();
    for (int z = column.low; z <= column.high; ++z) {
      const std::size_t n = column.position * layers_ + static_cast<std::size_t>(z);
      words_.push_back(std::exchange(scratch_[n], 0));
      floors_.push_back(std::exchange(scratch_floors_[n], kNoFloors));
    }
    touched_[column.position] = 0;
  }
}

/// Slides a byte along the elements of one row and puts it into the words of the eight positions along y that hold it.
void TileSweep::scatter(std::size_t kind, int y, int z) {
  const auto& board = whole_.boards_[kind];
  if (board.x.empty()) return;
  const auto& stencil = whole_.stencils_[kind];
  const int width = whole_.width_, x0 = corner_.x() - whole_.radius_, row = y - corner_.y() + whole_.radius_;
  const auto line = static_cast<std::size_t>(z * grid_.size().y() + y);
  const auto end = board.x.begin() + board.row_first[line + 1];
  int low = width, high = -1;
  for (auto x = std::lower_bound(board.x.begin() + board.row_first[line], end, x0); x != end && *x < x0 + width + 7;
       ++x) {
    const std::int16_t floor = board.floor[static_cast<std::size_t>(x - board.x.begin())];
    const int first = std::max(0, *x - x0 - 7), last = std::min(width - 1, *x - x0);
    low = std::min(low, first), high = std::max(high, last);
    for (int wx = first; wx <= last; ++wx) {
      row_bytes_[static_cast<std::size_t>(wx)] |= std::uint64_t{1} << (*x - x0 - wx);
      row_floors_[static_cast<std::size_t>(wx)].take(floor);
    }
  }
  for (int wx = low; wx <= high; ++wx) {
    const std::uint64_t byte = std::exchange(row_bytes_[static_cast<std::size_t>(wx)], 0);
    const Floors floors = std::exchange(row_floors_[static_cast<std::size_t>(wx)], kNoFloors);
    if (!byte) continue;
    for (int ly = std::max(0, row - width + 1); ly <= std::min(7, row); ++ly) {
      const auto position = static_cast<std::uint32_t>((row - ly) * width + wx);
      if (stencil.first[position] == stencil.first[position + 1]) continue;
      if (!touched_[position]) {
        columns_[kind].push_back({position, z, z, kNoFloors, 0});
        touched_[position] = static_cast<std::uint32_t>(columns_[kind].size());
      }
      Column& column = columns_[kind][touched_[position] - 1];
      const std::size_t n = position * layers_ + static_cast<std::size_t>(z);
      column.high = z, column.floors.take(floors);
      scratch_[n] |= byte << 8 * ly;
      scratch_floors_[n].take(floors);
    }
  }
}

}  // namespace backwash::field

// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/whole_field.hpp"

#include <algorithm>
#include <cmath>

#include "core/field/lateral/block_sweep.hpp"
#include "core/field/sight/sight_path.hpp"

namespace backwash::field {

WholeField::WholeField(const map::OccupancyGrid& grid, const Model& model, std::span<const std::size_t> voxels,
                       std::size_t most_steps)
    : grid_(&grid),
      model_(model),
      terms_(model, grid.resolution()),
      lateral_(grid, model),
      row_words_((static_cast<std::size_t>(grid.size().x()) + 63) / 64 + 3) {
  const auto& g = model.ground;
  const double a = grid.resolution(), cone = g.l_max * (g.theta_max < 1.5 ? std::sin(g.theta_max) : 1.0);
  radius_ = static_cast<int>(std::max(cone, std::min(g.r0, g.l_footprint_max)) / a + 1e-6) + 1;
  width_ = 2 * radius_ + 1;
  add_rows(voxels);
  if (voxels.empty()) return;
  add_blocks(voxels);
  add_stencil();
  add_paths(most_steps);
}

void WholeField::add_rows(std::span<const std::size_t> voxels) {
  const Index3& size = grid_->size();
  const std::size_t rows = static_cast<std::size_t>(size.y()) * static_cast<std::size_t>(size.z());
  occupied_.assign(rows * row_words_, 0);
  up_ = occupied_;
  listed_ = occupied_;
  const auto set = [&](std::vector<std::uint64_t>& bits, std::size_t row, std::size_t x) {
    bits[row * row_words_ + (x + 64) / 64] |= std::uint64_t{1} << x % 64;
  };
  const auto nx = static_cast<std::size_t>(size.x()), layer = nx * static_cast<std::size_t>(size.y());
  for (std::size_t row = 0, n = 0; row < rows; ++row)
    for (std::size_t x = 0; x < nx; ++x, ++n) {
      const bool occupied = grid_->at(n) == map::Cell::occupied;
      if (!occupied && !(model_.unknown_floor && grid_->at(n) == map::Cell::unknown)) continue;
      if (occupied) set(occupied_, row, x);
      if (n + layer < grid_->cell_count() && grid_->at(n + layer) == map::Cell::free) set(up_, row, x);
    }
  for (const std::size_t n : voxels) set(listed_, n / nx, n % nx);
}

/// Covers the columns that hold listed voxels: parts of equal width, so that threads get equal shares.
void WholeField::add_blocks(std::span<const std::size_t> voxels) {
  const auto nx = static_cast<std::size_t>(grid_->size().x()), ny = static_cast<std::size_t>(grid_->size().y());
  std::vector<char> rows(ny);
  std::size_t low = nx, high = 0;
  for (const std::size_t n : voxels) {
    const std::size_t x = n % nx;
    rows[n / nx % ny] = 1;
    low = std::min(low, x);
    high = std::max(high, x);
  }
  const int first = static_cast<int>(low), end = static_cast<int>(high) + 1;
  const int across = (end - first + 63) / 64, width = (end - first + across - 1) / across;
  for (std::size_t y = 0; y < ny; ++y) {
    if (!rows[y]) continue;
    for (int x = first; x < end; x += width) blocks_.push_back({x, static_cast<int>(y), std::min(width, end - x)});
    y += kRows - 1;
  }
}

void WholeField::add_stencil() {
  const double a = grid_->resolution(), reach = std::max(model_.ground.l_max, model_.ground.l_footprint_max);
  const int lowest = -std::min(static_cast<int>(reach / a) + 1, grid_->size().z() - 1);
  stencil_.first.push_back(0);
  for (int x = -radius_; x <= radius_; ++x)
    for (int y = -radius_; y <= radius_; ++y) {
      for (int z = lowest; z < 0; ++z) {
        const Vec3 c = a * Vec3(x, y, z + 0.5);  // the vehicle is at 0
        const Variance ground = terms_.ground({Element::Kind::up, c, Vec3::UnitZ(), a * a, {}}, Vec3::Zero());
        if (ground.xx == 0 && ground.zz == 0) continue;
        stencil_.offsets.emplace_back(x, y, z);
        stencil_.terms.push_back({static_cast<float>(ground.xx), static_cast<float>(ground.zz)});
      }
      stencil_.first.push_back(static_cast<std::uint32_t>(stencil_.offsets.size()));
    }
}

void WholeField::add_paths(std::size_t most_steps) {
  std::vector<std::int32_t> scratch;
  std::vector<std::uint32_t> step_first{0};
  for (std::uint32_t n = 0; n < stencil_.offsets.size(); ++n) {
    const auto steps = path(n, scratch);
    stencil_.steps.insert(stencil_.steps.end(), steps.begin(), steps.end());
    step_first.push_back(static_cast<std::uint32_t>(stencil_.steps.size()));
    if (stencil_.steps.size() > most_steps) {
      stencil_.steps = {};
      return;
    }
  }
  stencil_.step_first = std::move(step_first);
}

std::span<const std::int32_t> WholeField::path(std::uint32_t offset, std::vector<std::int32_t>& scratch) const {
  if (!stencil_.step_first.empty()) {
    const std::uint32_t first = stencil_.step_first[offset], last = stencil_.step_first[offset + 1];
    return std::span(stencil_.steps).subspan(first, last - first);
  }
  const int height = static_cast<int>(kRows) + 2 * radius_;
  scratch.clear();
  for (const Index3& cell : cells_on_path(stencil_.offsets[offset], 0.5 * Vec3::UnitZ()))
    scratch.push_back((cell.x() * grid_->size().z() + cell.z()) * height + cell.y());
  return scratch;
}

void WholeField::evaluate(std::size_t begin, std::size_t end,
                          const std::function<void(std::size_t, const Variance&)>& store) const {
  if (begin != end) BlockSweep(*this).run(std::span(blocks_).subspan(begin, end - begin), store);
}

}  // namespace backwash::field

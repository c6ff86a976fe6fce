// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/lateral/block_sweep.hpp"

#include <algorithm>
#include <bit>

#include "core/field/lateral/kernels.hpp"

namespace backwash::field {
namespace {

constexpr std::size_t kRowsAtOnce = 8;  // rows that a kernel takes together

}  // namespace

BlockSweep::BlockSweep(const WholeField& whole)
    : whole_(whole),
      layers_(static_cast<std::size_t>(whole.grid_->size().z())),
      height_(kRows + 2 * static_cast<std::size_t>(whole.radius_)),
      occupied_(static_cast<std::size_t>(whole.width_) * layers_ * height_),
      targets_(layers_ * kRows),
      elements_(layers_ * height_),
      eight_(elements_),
      targeted_(2 * layers_),
      h_part_(64 * layers_ * kRows),
      v_part_(h_part_),
      h_(h_part_),
      v_(h_part_) {}

std::uint64_t BlockSweep::row_of(const std::vector<std::uint64_t>& bits, int x, int y, int z) const noexcept {
  const Index3& size = whole_.grid_->size();
  if (y < 0 || y >= size.y() || x <= -64 || x >= size.x()) return 0;
  const auto at = static_cast<std::size_t>(x + 64);  // an empty word before each row, two behind
  const std::uint64_t* word =
      bits.data() +
      (static_cast<std::size_t>(z) * static_cast<std::size_t>(size.y()) + static_cast<std::size_t>(y)) *
          whole_.row_words_ +
      at / 64;
  const auto shift = static_cast<unsigned>(at % 64);
  return word[0] >> shift | (shift ? word[1] << (64 - shift) : 0);
}

void BlockSweep::open(const WholeField::Block& block) {
  block_ = block;
  const int r = whole_.radius_;
  std::size_t n = 0;
  for (int dx = -r; dx <= r; ++dx)
    for (int z = 0; z < static_cast<int>(layers_); ++z)
      for (int row = 0; row < static_cast<int>(height_); ++row)
        occupied_[n++] = row_of(whole_.occupied_, block.x + dx, block.y + row - r, z);
  n = 0;
  const std::uint64_t in_block = block.width == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << block.width) - 1;
  for (int z = 0; z < static_cast<int>(layers_); ++z)
    for (int row = 0; row < static_cast<int>(kRows); ++row)
      targets_[n++] = row_of(whole_.listed_, block.x, block.y + row, z) & in_block;
  for (n = 0; n < targeted_.size(); ++n) {
    targeted_[n] = 0;
    for (std::size_t row = 0; row < kRowsAtOnce; ++row) targeted_[n] |= targets_[n * kRowsAtOnce + row];
  }
  std::ranges::fill(h_, 0);
  std::ranges::fill(v_, 0);
  std::ranges::fill(h_part_, 0);
  std::ranges::fill(v_part_, 0);
}

void BlockSweep::open_plane(int dx) {
  levels_.clear();
  for (int z = 0; z < static_cast<int>(layers_); ++z) {
    std::uint64_t* rows = elements_.data() + static_cast<std::size_t>(z) * height_;
    std::uint64_t any = 0;
    for (int row = 0; row < static_cast<int>(height_); ++row)
      any |= rows[row] = row_of(whole_.up_, block_.x + dx, block_.y + row - whole_.radius_, z);
    if (!any) continue;
    levels_.push_back(z);
    std::uint64_t* eight = eight_.data() + static_cast<std::size_t>(z) * height_;
    for (std::size_t row = 0; row + kRowsAtOnce <= height_; ++row) {
      eight[row] = 0;
      for (std::size_t n = 0; n < kRowsAtOnce; ++n) eight[row] |= rows[row + n];
    }
  }
}

void BlockSweep::sweep_plane(int dx) {
  const auto& stencil = whole_.stencil_;
  const auto r = static_cast<std::size_t>(whole_.radius_);
  const auto column = static_cast<std::size_t>(dx + whole_.radius_) * static_cast<std::size_t>(whole_.width_);
  const std::uint64_t* here = occupied_.data() + r * layers_ * height_ + r;
  for (std::size_t dy = 0; dy < static_cast<std::size_t>(whole_.width_); ++dy)
    for (std::uint32_t n = stencil.first[column + dy]; n < stencil.first[column + dy + 1]; ++n) {
      const auto steps = whole_.path(n, path_);
      for (const int level : levels_) {
        const auto z = static_cast<std::size_t>(level - stencil.offsets[n].z());
        if (z >= layers_) continue;
        const std::size_t at = static_cast<std::size_t>(level) * height_ + dy;
        for (std::size_t y = 0; y < kRows; y += kRowsAtOnce) {
          if (!(targeted_[(z * kRows + y) / kRowsAtOnce] & eight_[at + y])) continue;
          add_visible(targets_.data() + z * kRows + y, elements_.data() + at + y, here + z * height_ + y, steps,
                      kRowsAtOnce, stencil.terms[n].horizontal, stencil.terms[n].vertical,
                      h_part_.data() + sum_row(z, y), v_part_.data() + sum_row(z, y));
        }
      }
    }
}

void BlockSweep::take_over_sums() {
  for (std::size_t n = 0; n < h_.size(); ++n) {
    h_[n] += h_part_[n];
    h_part_[n] = 0;
  }
  for (std::size_t n = 0; n < v_.size(); ++n) {
    v_[n] += v_part_[n];
    v_part_[n] = 0;
  }
}

void BlockSweep::sweep(const WholeField::Block& block) {
  open(block);
  for (int dx = -whole_.radius_; dx <= whole_.radius_; ++dx) {
    open_plane(dx);
    if (levels_.empty()) continue;
    sweep_plane(dx);
    take_over_sums();
  }
}

std::uint64_t BlockSweep::column_targets(std::size_t x, std::size_t y, std::size_t z) const noexcept {
  std::uint64_t targets = 0;
  for (std::size_t n = 0; n < 64 && z + n < layers_; ++n) targets |= (targets_[(z + n) * kRows + y] >> x & 1) << n;
  return targets;
}

template <typename Lateral, typename Store>
void BlockSweep::each(Lateral& lateral, const Store& store) {
  const auto& base = whole_.model_.base;
  for (std::size_t z0 = 0; z0 < layers_; z0 += LateralColumns::kLayers) {
    lateral.open(block_.x, block_.y, kRows, static_cast<int>(z0));
    for (std::size_t y = 0; y < kRows; ++y)
      for (std::size_t x = 0; x < static_cast<std::size_t>(block_.width); ++x) {
        std::uint64_t targets = column_targets(x, y, z0);
        if (!targets) continue;
        const int at_x = block_.x + static_cast<int>(x), at_y = block_.y + static_cast<int>(y);
        const LateralColumns::Sums& sums = lateral.sum(at_x, at_y, targets);
        for (; targets; targets &= targets - 1) {
          const auto n = static_cast<std::size_t>(std::countr_zero(targets));
          const std::size_t ground = sum_row(z0 + n, y) + x;
          const double h = base.horizontal + static_cast<double>(h_[ground]);
          store(whole_.grid_->linear(Index3(at_x, at_y, static_cast<int>(z0 + n))),
                Variance{h + sums.xx[n], sums.xy[n], 0, h + sums.yy[n], 0,
                         base.vertical + static_cast<double>(v_[ground]) + sums.zz[n]});
        }
      }
  }
}

void BlockSweep::run(std::span<const WholeField::Block> blocks,
                     const std::function<void(std::size_t, const Variance&)>& store) {
  const auto sweep_all = [&](auto lateral) {
    for (const WholeField::Block& block : blocks) {
      sweep(block);
      each(lateral, store);
    }
  };
  if (whole_.grid_->size().z() <= LateralColumns::kLayers)
    sweep_all(LateralSweep<std::uint64_t>(whole_.lateral_));
  else
    sweep_all(LateralSweep<Layers>(whole_.lateral_));
}

}  // namespace backwash::field

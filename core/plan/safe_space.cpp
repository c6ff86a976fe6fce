// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/safe_space.hpp"

#include <cassert>
#include <utility>

namespace backwash::plan {

SafeSpace::SafeSpace(const map::OccupancyGrid& grid, std::vector<std::uint8_t> passable)
    : origin_W_(grid.origin()), resolution_(grid.resolution()), size_(grid.size()), passable_(std::move(passable)) {
  assert(passable_.size() == grid.cell_count());
  const int nx = size_.x() + 1, ny = size_.y() + 1, nz = size_.z() + 1;
  blocked_.assign(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz), 0);
  for (int k = 1; k < nz; ++k)
    for (int j = 1; j < ny; ++j) {
      std::uint32_t row = 0;
      const std::size_t cells = linear({0, j - 1, k - 1});
      for (int i = 1; i < nx; ++i) {
        row += passable_[cells + static_cast<std::size_t>(i - 1)] ? 0 : 1;
        blocked_[static_cast<std::size_t>(i + nx * (j + ny * k))] =
            row + blocked_below(i, j - 1, k) + blocked_below(i, j, k - 1) - blocked_below(i, j - 1, k - 1);
      }
    }
}

bool SafeSpace::passable(const Index3& v) const noexcept {
  return (v.array() >= 0).all() && (v.array() < size_.array()).all() && passable_[linear(v)];
}

bool SafeSpace::clear(const Box& box) const noexcept {
  const Index3 low = index(box.low), high = index(box.high);
  if ((low.array() < 0).any() || (high.array() >= size_.array()).any()) return false;
  const int i0 = low.x(), j0 = low.y(), k0 = low.z(), i1 = high.x() + 1, j1 = high.y() + 1, k1 = high.z() + 1;
  // Unsigned wrap-around cancels in the alternating sum.
  return blocked_below(i1, j1, k1) - blocked_below(i0, j1, k1) - blocked_below(i1, j0, k1) - blocked_below(i1, j1, k0) +
             blocked_below(i0, j0, k1) + blocked_below(i0, j1, k0) + blocked_below(i1, j0, k0) -
             blocked_below(i0, j0, k0) ==
         0;
}

bool SafeSpace::clear(const Motion& motion) const noexcept {
  const auto piece_clear = [&](const auto& self, double from, double to) -> bool {
    const Box box = bounds(motion, from, to);
    if (clear(box)) return true;
    const double middle = (from + to) / 2;
    if ((box.high - box.low).maxCoeff() < resolution_ / 4 || !passable(index(motion.position(middle)))) return false;
    return self(self, from, middle) && self(self, middle, to);
  };
  return piece_clear(piece_clear, 0, motion.duration);
}

std::vector<std::uint32_t> SafeSpace::hops_to(const Index3& goal) const {
  std::vector<std::uint32_t> hops(passable_.size(), kUnreached);
  if (!passable(goal)) return hops;
  std::vector<Index3> front{goal}, next;
  hops[linear(goal)] = 0;
  for (std::uint32_t distance = 1; !front.empty(); ++distance) {
    next.clear();
    for (const Index3& v : front)
      for (int k = std::max(v.z() - 1, 0); k <= std::min(v.z() + 1, size_.z() - 1); ++k)
        for (int j = std::max(v.y() - 1, 0); j <= std::min(v.y() + 1, size_.y() - 1); ++j)
          for (int i = std::max(v.x() - 1, 0); i <= std::min(v.x() + 1, size_.x() - 1); ++i) {
            const std::size_t cell = linear({i, j, k});
            if (!passable_[cell] || hops[cell] != kUnreached) continue;
            hops[cell] = distance;
            next.push_back({i, j, k});
          }
    std::swap(front, next);
  }
  return hops;
}

}  // namespace backwash::plan

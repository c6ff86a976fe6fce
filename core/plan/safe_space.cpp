// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/safe_space.hpp"

#include <algorithm>

namespace backwash::plan {

bool SafeSpace::clear(const Box& box) const noexcept {
  return sums_.voxels_free(passable_.index(box.low), passable_.index(box.high));
}

bool SafeSpace::clear(const Motion& motion) const noexcept {
  const auto piece_clear = [&](const auto& self, double from, double to) -> bool {
    const Box box = bounds(motion, from, to);
    if (clear(box)) return true;
    const double middle = (from + to) / 2;
    if ((box.high - box.low).maxCoeff() < passable_.resolution() / 4 ||
        !passable(passable_.index(motion.position(middle))))
      return false;
    return self(self, from, middle) && self(self, middle, to);
  };
  return piece_clear(piece_clear, 0, motion.duration);
}

std::vector<std::uint32_t> SafeSpace::hops_to(const Index3& goal) const {
  std::vector<std::uint32_t> hops(passable_.cell_count(), kUnreached);
  if (!passable(goal)) return hops;
  const Index3& size = passable_.size();
  std::vector<Index3> front{goal}, next;
  hops[passable_.linear(goal)] = 0;
  for (std::uint32_t distance = 1; !front.empty(); ++distance) {
    next.clear();
    for (const Index3& v : front)
      for (int k = std::max(v.z() - 1, 0); k <= std::min(v.z() + 1, size.z() - 1); ++k)
        for (int j = std::max(v.y() - 1, 0); j <= std::min(v.y() + 1, size.y() - 1); ++j)
          for (int i = std::max(v.x() - 1, 0); i <= std::min(v.x() + 1, size.x() - 1); ++i) {
            const std::size_t cell = passable_.linear({i, j, k});
            if (passable_.at(cell) != map::Cell::free || hops[cell] != kUnreached) continue;
            hops[cell] = distance;
            next.push_back({i, j, k});
          }
    std::swap(front, next);
  }
  return hops;
}

}  // namespace backwash::plan

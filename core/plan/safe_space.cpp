// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/safe_space.hpp"

#include <algorithm>
#include <array>
#include <cassert>

namespace backwash::plan {

SafeSpace::SafeSpace(const map::OccupancyGrid& grid, std::vector<std::uint8_t> passable)
    : origin_W_(grid.origin()), resolution_(grid.resolution()), size_(grid.size()) {
  assert(passable.size() == grid.cell_count());
  add_up(passable);
  region_.assign(passable.begin(), passable.end());
  number_regions();
}

void SafeSpace::add_up(const std::vector<std::uint8_t>& passable) {
  const int nx = size_.x() + 1, ny = size_.y() + 1, nz = size_.z() + 1;
  blocked_.assign(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz), 0);
  for (int k = 1; k < nz; ++k)
    for (int j = 1; j < ny; ++j) {
      std::uint32_t row = 0;
      const std::size_t cells = linear({0, j - 1, k - 1});
      for (int i = 1; i < nx; ++i) {
        row += passable[cells + static_cast<std::size_t>(i - 1)] ? 0 : 1;
        blocked_[static_cast<std::size_t>(i + nx * (j + ny * k))] =
            row + blocked_below(i, j - 1, k) + blocked_below(i, j, k - 1) - blocked_below(i, j - 1, k - 1);
      }
    }
}

// Two passes: provisional numbers from the neighbours before each voxel, joined in a forest, then the trees' roots.
void SafeSpace::number_regions() {
  std::vector<std::uint32_t> parent{kNoRegion};
  const auto root = [&parent](std::uint32_t n) {
    while (parent[n] != n) n = parent[n] = parent[parent[n]];
    return n;
  };
  const std::array<std::size_t, 3> strides{1, static_cast<std::size_t>(size_.x()),
                                           static_cast<std::size_t>(size_.x()) * static_cast<std::size_t>(size_.y())};
  std::size_t n = 0;
  for (int k = 0; k < size_.z(); ++k)
    for (int j = 0; j < size_.y(); ++j)
      for (int i = 0; i < size_.x(); ++i, ++n) {
        if (region_[n] == 0) continue;
        std::uint32_t number = kNoRegion;
        const std::array<bool, 3> has{i > 0, j > 0, k > 0};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const std::uint32_t before = has[axis] ? region_[n - strides[axis]] : kNoRegion;
          if (before == kNoRegion || before == number) continue;
          if (number == kNoRegion)
            number = before;
          else
            parent[std::max(root(number), root(before))] = std::min(root(number), root(before));
        }
        if (number == kNoRegion) parent.push_back(number = static_cast<std::uint32_t>(parent.size()));
        region_[n] = number;
      }
  for (std::uint32_t& region : region_) region = root(region);
}

std::uint32_t SafeSpace::blocked(const Index3& low, const Index3& high) const noexcept {
  const int i0 = low.x(), j0 = low.y(), k0 = low.z(), i1 = high.x() + 1, j1 = high.y() + 1, k1 = high.z() + 1;
  // Unsigned wrap-around cancels in the alternating sum.
  return blocked_below(i1, j1, k1) - blocked_below(i0, j1, k1) - blocked_below(i1, j0, k1) - blocked_below(i1, j1, k0) +
         blocked_below(i0, j0, k1) + blocked_below(i0, j1, k0) + blocked_below(i1, j0, k0) - blocked_below(i0, j0, k0);
}

SafeView::SafeView(const SafeSpace& space, const std::vector<Index3>& also) : space_(&space) {
  for (const Index3& v : also)
    if (space.inside(v) && !space.passable(v) && std::ranges::find(also_, v) == also_.end()) also_.push_back(v);
}

bool SafeView::passable(const Index3& v) const noexcept {
  return space_->passable(v) || std::ranges::find(also_, v) != also_.end();
}

bool SafeView::clear(const Box& box) const noexcept {
  const Index3 low = space_->index(box.low), high = space_->index(box.high);
  if (!space_->inside(low) || !space_->inside(high)) return false;
  const auto within = [&](const Index3& v) {
    return (v.array() >= low.array()).all() && (v.array() <= high.array()).all();
  };
  return space_->blocked(low, high) == static_cast<std::uint32_t>(std::ranges::count_if(also_, within));
}

bool SafeView::clear(const Motion& motion) const noexcept {
  const auto piece_clear = [&](const auto& self, double from, double to) -> bool {
    const Box box = bounds(motion, from, to);
    if (clear(box)) return true;
    const double middle = (from + to) / 2;
    if ((box.high - box.low).maxCoeff() < space_->resolution() / 4 || !passable(space_->index(motion.position(middle))))
      return false;
    return self(self, from, middle) && self(self, middle, to);
  };
  return piece_clear(piece_clear, 0, motion.duration);
}

bool SafeView::may_join(const Index3& a, const Index3& b) const noexcept {
  const std::uint32_t one = space_->region(a), other = space_->region(b);
  // An extra voxel may join regions: say yes.
  return one == other || !also_.empty() || one == SafeSpace::kNoRegion || other == SafeSpace::kNoRegion;
}

namespace {

/// Visits the neighbours of v inside the space, faces only or all 26.
template <typename Visit>
void for_each_neighbour(const SafeSpace& space, const Index3& v, bool faces_only, const Visit& visit) {
  for (int k = std::max(v.z() - 1, 0); k <= std::min(v.z() + 1, space.size().z() - 1); ++k)
    for (int j = std::max(v.y() - 1, 0); j <= std::min(v.y() + 1, space.size().y() - 1); ++j)
      for (int i = std::max(v.x() - 1, 0); i <= std::min(v.x() + 1, space.size().x() - 1); ++i) {
        const Index3 u(i, j, k);
        if (!faces_only || (u - v).cwiseAbs().sum() == 1) visit(u);
      }
}

}  // namespace

Hops SafeView::hops_to(const Index3& goal, const Index3& enough) const {
  Hops hops{std::vector<std::uint32_t>(static_cast<std::size_t>(space_->size().prod()), Hops::kUnreached),
            Hops::kUnreached};
  if (!passable(goal)) return hops;
  std::vector<Index3> front{goal}, next;
  hops.of_voxel[space_->linear(goal)] = 0;
  std::uint32_t last = Hops::kUnreached;
  for (std::uint32_t distance = 1; !front.empty(); ++distance) {
    if (last == Hops::kUnreached && space_->inside(enough) && hops.of_voxel[space_->linear(enough)] != Hops::kUnreached)
      last = distance + distance / 4;
    if (distance > last) {
      hops.beyond = distance;
      break;
    }
    next.clear();
    for (const Index3& v : front)
      for_each_neighbour(*space_, v, false, [&](const Index3& u) {
        std::uint32_t& here = hops.of_voxel[space_->linear(u)];
        if (here != Hops::kUnreached || !passable(u)) return;
        here = distance;
        next.push_back(u);
      });
    std::swap(front, next);
  }
  return hops;
}

std::vector<Index3> SafeView::chain(const Index3& from, const Index3& to) const {
  std::vector<Index3> way;
  if (!passable(from) || !passable(to)) return way;
  // Flooded from the end, so that the way can be read off from the start.
  std::vector<std::uint32_t> towards(static_cast<std::size_t>(space_->size().prod()), Hops::kUnreached);
  std::vector<Index3> order{to};
  towards[space_->linear(to)] = static_cast<std::uint32_t>(space_->linear(to));
  for (std::size_t n = 0; n < order.size() && towards[space_->linear(from)] == Hops::kUnreached; ++n) {
    const Index3 v = order[n];
    for_each_neighbour(*space_, v, true, [&](const Index3& u) {
      std::uint32_t& here = towards[space_->linear(u)];
      if (here != Hops::kUnreached || !passable(u)) return;
      here = static_cast<std::uint32_t>(space_->linear(v));
      order.push_back(u);
    });
  }
  std::size_t at = space_->linear(from);
  if (towards[at] == Hops::kUnreached) return way;
  const int nx = space_->size().x(), ny = space_->size().y();
  for (;; at = towards[at]) {
    const int n = static_cast<int>(at);
    way.emplace_back(n % nx, n / nx % ny, n / (nx * ny));
    if (at == towards[at]) return way;
  }
}

}  // namespace backwash::plan

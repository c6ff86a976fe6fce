// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/world/safe_space.hpp"

#include <algorithm>
#include <cassert>

namespace backwash::plan {

SafeSpace::SafeSpace(const map::OccupancyGrid& passable)
    : origin_W_(passable.origin()),
      resolution_(passable.resolution()),
      size_(passable.size()),
      sums_(passable),
      components_(passable) {}

void SafeSpace::update(const map::OccupancyGrid& passable, const map::VoxelBox& changed) {
  sums_.update(passable, changed.low, changed.high);
  components_.update(passable, changed);
}

SafeView::SafeView(const SafeSpace& space, const std::vector<Index3>& also) : space_(&space) {
  for (const Index3& v : also)
    if (space.inside(v) && !space.passable(v) && std::ranges::find(also_, v) == also_.end()) also_.push_back(v);
}

bool SafeView::passable(const Index3& v) const noexcept {
  return space_->passable(v) || std::ranges::find(also_, v) != also_.end();
}

bool SafeView::clear(const Box& box) const noexcept { return clear(space_->index(box.low), space_->index(box.high)); }

bool SafeView::clear(const Index3& low, const Index3& high) const noexcept {
  if (space_->passable(low, high)) return true;
  const auto extra = std::ranges::find_if(
      also_, [&](const Index3& v) { return (v.array() >= low.array()).all() && (v.array() <= high.array()).all(); });
  if (extra == also_.end()) return false;
  // The slabs below and above the extra voxel, axis by axis, make up the rest of the box.
  Index3 from = low, to = high;
  for (int axis = 0; axis < 3; ++axis) {
    Index3 end = to, begin = from;
    end[axis] = (*extra)[axis] - 1;
    begin[axis] = (*extra)[axis] + 1;
    if (!clear(from, end) || !clear(begin, to)) return false;
    from[axis] = to[axis] = (*extra)[axis];
  }
  return true;
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
  return one == other || !also_.empty() || one == Components::kNone || other == Components::kNone;
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

// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/components.hpp"

#include <algorithm>
#include <limits>
#include <memory>
#include <numeric>

namespace backwash::plan {
namespace {

/// Numbers that are joined in trees; the root is the least of a tree.
class Forest {
 public:
  explicit Forest(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t add() {
    parent_.push_back(static_cast<std::uint32_t>(parent_.size()));
    return parent_.back();
  }
  std::uint32_t root(std::uint32_t n) noexcept {
    while (parent_[n] != n) n = parent_[n] = parent_[parent_[n]];
    return n;
  }
  void join(std::uint32_t a, std::uint32_t b) noexcept {
    a = root(a), b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }
  std::size_t size() const noexcept { return parent_.size(); }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace

Components::Components(const map::OccupancyGrid& free)
    : tiles_(free.size(), std::make_shared<const Tile>()), first_(tiles_.count()) {
  update(free, map::all_of(free.size()));
}

void Components::update(const map::OccupancyGrid& free, const map::VoxelBox& changed) {
  const auto none = std::make_shared<const Tile>();
  for (const std::size_t tile : tiles_.meeting(changed)) {
    const Tile fresh = numbered(free, tiles_.voxels(tile));
    tiles_.replace(tile, fresh.parts ? std::make_shared<const Tile>(fresh) : none);
  }
  join();
}

// Two passes: provisional numbers from the neighbours before each voxel, joined in a forest, then the trees' numbers.
Components::Tile Components::numbered(const map::OccupancyGrid& free, const map::VoxelBox& voxels) {
  std::array<std::uint16_t, std::size_t{1} << 3 * kShift> tree{};  // 0: none
  Forest forest(1);
  map::for_each_voxel(voxels, [&](const Index3& v) {
    if (!free.free(v)) return;
    std::uint16_t& here = tree[Grid::within(v)];
    for (int axis = 0; axis < 3; ++axis) {
      if (v[axis] == voxels.low[axis]) continue;
      const std::uint16_t before = tree[Grid::within(v - Index3::Unit(axis))];
      if (here && before) forest.join(here, before);
      if (!here) here = before;
    }
    if (!here) here = static_cast<std::uint16_t>(forest.add());
  });
  Tile tile;
  std::vector<std::uint8_t> of_tree(forest.size(), 0);  // a root stands before all of its tree
  for (std::uint32_t t = 1; t < forest.size(); ++t) {
    const std::uint32_t root = forest.root(t);
    constexpr auto kMost = std::numeric_limits<std::uint8_t>::max();
    if (root == t && tile.parts < kMost) ++tile.parts;
    of_tree[t] = root == t ? tile.parts : of_tree[root];
  }
  std::ranges::transform(tree, tile.part.begin(), [&](std::uint16_t t) { return of_tree[t]; });
  return tile;
}

// Parts that touch across the faces of two tiles are one region.
void Components::join() {
  std::uint32_t count = 0;
  for (std::size_t tile = 0; tile < tiles_.count(); ++tile) {
    first_[tile] = count;
    count += tiles_[tile].parts + 1u;
  }
  Forest forest(count);
  for (std::size_t tile = 0; tile < tiles_.count(); ++tile) {
    const Tile& here = tiles_[tile];
    const map::VoxelBox voxels = tiles_.voxels(tile);
    for (int axis = 0; axis < 3 && here.parts; ++axis) {
      if (voxels.high[axis] + 1 == tiles_.size()[axis]) continue;
      map::VoxelBox face = voxels;
      face.low[axis] = voxels.high[axis];
      const std::size_t next = tiles_.holding(face.low + Index3::Unit(axis));
      const Tile& beyond = tiles_[next];
      std::uint32_t last_here = 0, last_beyond = 0;  // most faces join one pair
      map::for_each_voxel(face, [&](const Index3& v) {
        const std::uint32_t a = here.part[Grid::within(v)], b = beyond.part[Grid::within(v + Index3::Unit(axis))];
        if (!a || !b || (a == last_here && b == last_beyond)) return;
        forest.join(first_[tile] + a, first_[next] + b);
        last_here = a, last_beyond = b;
      });
    }
  }
  component_.assign(count, kNone);
  std::uint32_t last = kNone;
  for (std::size_t tile = 0; tile < tiles_.count(); ++tile)
    for (std::uint32_t part = 1; part <= tiles_[tile].parts; ++part) {
      const std::uint32_t n = first_[tile] + part, root = forest.root(n);
      component_[n] = root == n ? ++last : component_[root];
    }
}

}  // namespace backwash::plan

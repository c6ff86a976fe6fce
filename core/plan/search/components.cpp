// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/search/components.hpp"

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
    a = root(a);
    b = root(b);
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
  const auto tiles = tiles_.meeting(changed);
  for (const std::size_t tile : tiles) {
    Tile fresh = numbered(free, tiles_.voxels(tile));
    tiles_.replace(tile, fresh.parts ? std::make_shared<const Tile>(std::move(fresh)) : none);
  }
  // What a tile joins depends on the tiles above it, too: those below the changed ones are looked at again.
  map::VoxelBox touching = changed;
  if (!tiles.empty()) touching.low = tiles_.voxels(tiles.front()).low - Index3::Ones();
  for (const std::size_t tile : tiles_.meeting(touching)) {
    if (!tiles_[tile].parts) continue;
    Tile joined = tiles_[tile];
    joined.joints = joints_of(tile);
    tiles_.replace(tile, std::make_shared<const Tile>(std::move(joined)));
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
std::vector<Components::Joint> Components::joints_of(std::size_t tile) const {
  const Tile& here = tiles_[tile];
  const map::VoxelBox voxels = tiles_.voxels(tile);
  std::vector<Joint> joints;
  for (int axis = 0; axis < 3; ++axis) {
    if (voxels.high[axis] + 1 == tiles_.size()[axis]) continue;
    map::VoxelBox face = voxels;
    face.low[axis] = voxels.high[axis];
    const Tile& beyond = tiles_.of(face.low + Index3::Unit(axis));
    const std::size_t first = joints.size();
    map::for_each_voxel(face, [&](const Index3& v) {
      const Joint joint{static_cast<std::uint8_t>(axis), here.part[Grid::within(v)],
                        beyond.part[Grid::within(v + Index3::Unit(axis))]};
      if (!joint.part || !joint.beyond) return;
      for (std::size_t n = joints.size(); n > first; --n)  // most faces join one pair
        if (joints[n - 1].part == joint.part && joints[n - 1].beyond == joint.beyond) return;
      joints.push_back(joint);
    });
  }
  return joints;
}

void Components::join() {
  std::uint32_t count = 0;
  for (std::size_t tile = 0; tile < tiles_.count(); ++tile) {
    first_[tile] = count;
    count += tiles_[tile].parts + 1u;
  }
  Forest forest(count);
  const auto& counts = tiles_.counts();
  const std::array<std::size_t, 3> next = {1, static_cast<std::size_t>(counts.x()),
                                           static_cast<std::size_t>(counts.x()) * static_cast<std::size_t>(counts.y())};
  for (std::size_t tile = 0; tile < tiles_.count(); ++tile)
    for (const Joint& joint : tiles_[tile].joints)
      forest.join(first_[tile] + joint.part, first_[tile + next[joint.axis]] + joint.beyond);
  component_.assign(count, kNone);
  std::uint32_t last = kNone;
  for (std::size_t tile = 0; tile < tiles_.count(); ++tile)
    for (std::uint32_t part = 1; part <= tiles_[tile].parts; ++part) {
      const std::uint32_t n = first_[tile] + part, root = forest.root(n);
      component_[n] = root == n ? ++last : component_[root];
    }
}

}  // namespace backwash::plan

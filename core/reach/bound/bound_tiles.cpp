// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/bound/bound_tiles.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <utility>

namespace backwash::reach {
namespace {

constexpr int kAhead = (1 << (BoundTiles::kLevels - 1)) - 1;  // from a cube's lowest voxel to its last

void raise(BoundCodes& maximum, const BoundCodes& other) noexcept {
  for (std::size_t d = 0; d < kDirections; ++d) maximum[d] = std::max(maximum[d], other[d]);
}

map::VoxelBox grown(const map::VoxelBox& box, int below, int above, const Index3& size) {
  return map::common({box.low - Index3::Constant(below), box.high + Index3::Constant(above)}, map::all_of(size));
}

/// Codes padded to a whole vector: compilers take maxima of an array one by one.
struct Padded {
  using Codes [[gnu::vector_size(16)]] = BoundCode;
  static_assert(sizeof(BoundCodes) <= sizeof(Codes));
  Codes codes{};
};

/// Each cell of a box becomes what `join` makes of it and the one `step` further on, along each axis in turn.
template <class Cell, class Join>
void join_ahead(std::vector<Cell>& cells, const Index3& extent, int step, const Join& join) {
  std::size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t block = stride * static_cast<std::size_t>(extent[axis]);
    const std::size_t ahead = stride * static_cast<std::size_t>(step), count = block > ahead ? block - ahead : 0;
    for (std::size_t first = 0; first < cells.size(); first += block) {
      Cell* const here = cells.data() + first;
      for (std::size_t n = 0; n < count; ++n) here[n] = join(here[n], here[n + ahead]);
    }
    stride = block;
  }
}

}  // namespace

struct BoundTiles::Marks {
  map::VoxelBox box;
  std::vector<std::uint8_t> mark;
  std::uint8_t& at(const Index3& v) { return mark[map::linear(box.high - box.low + Index3::Ones(), v - box.low)]; }
  bool at(const Index3& v) const { return mark[map::linear(box.high - box.low + Index3::Ones(), v - box.low)]; }
};

/// Visits the entries of the voxels of a box, x fastest, row by row.
template <class Visit>
void BoundTiles::for_each_entry(const map::VoxelBox& box, const Visit& visit) const {
  for (int k = box.low.z(); k <= box.high.z(); ++k)
    for (int j = box.low.y(); j <= box.high.y(); ++j) {
      const auto* const tiles = tiles_.row(j, k);
      const std::size_t row = Grid::within({0, j, k});
      for (int i = box.low.x(); i <= box.high.x(); ++i)
        visit(tiles[i >> kShift]->at(row | static_cast<std::size_t>(i & (Grid::kEdge - 1))));
    }
}

BoundTiles::BoundTiles(const Index3& size) : tiles_(size, std::make_shared<const Tile>()) {}

// A voxel has an entry if its largest cube holds one whose w̄ is stored: dilation, axis by axis.
BoundTiles::Marks BoundTiles::entered(const map::VoxelBox& changed, std::span<const std::size_t> listed) const {
  Marks marks{grown(changed, kAhead, kAhead, size()), {}};
  const Index3 extent = marks.box.high - marks.box.low + Index3::Ones();
  marks.mark.reserve(static_cast<std::size_t>(extent.prod()));
  for_each_entry(marks.box, [&](const Entry& entry) { marks.mark.push_back(some(entry.level[0])); });
  for (int k = changed.low.z(); k <= changed.high.z(); ++k)
    for (int j = changed.low.y(); j <= changed.high.y(); ++j)
      std::fill_n(&marks.at({changed.low.x(), j, k}), changed.high.x() - changed.low.x() + 1, std::uint8_t{0});
  for (const std::size_t n : listed) marks.at(map::voxel(size(), n)) = 1;
  for (int step = 1; step <= kAhead; step *= 2)
    join_ahead(marks.mark, extent, step, [](auto a, auto b) { return static_cast<std::uint8_t>(a | b); });
  return marks;
}

// What is outside the changed box is taken over.
BoundTiles::Tile BoundTiles::renumbered(std::size_t tile, const map::VoxelBox& changed, const Marks& marks) const {
  const map::VoxelBox anew = grown(changed, kAhead, 0, size());
  const Tile& old = tiles_[tile];
  Tile fresh;
  const map::VoxelBox box = tiles_.voxels(tile);
  std::vector<std::size_t> kept;  // where the entry of each voxel was
  map::for_each_voxel(box, [&](const Index3& v) {
    const std::size_t n = Grid::within(v);
    if (!(anew.contains(v) ? marks.at(v) : old.rank[n] != 0)) return;
    fresh.rank[n] = 1;
    kept.push_back(changed.contains(v) ? 0 : old.entry_of(n));
  });
  std::size_t count = 0;
  for (std::size_t n = 0; n < kVoxels; ++n) {
    if (n % kRun == 0) fresh.before[n / kRun] = static_cast<std::uint16_t>(count);
    if (fresh.rank[n]) fresh.rank[n] = static_cast<std::uint8_t>(++count - fresh.before[n / kRun]);
  }
  fresh.entries.reserve(kept.size() + 1);
  for (const std::size_t e : kept) fresh.entries.push_back(old.entries[e]);
  return fresh;
}

void BoundTiles::update(const map::VoxelBox& changed, std::span<const std::size_t> listed, const FillBounds& fill,
                        const Parallel& parallel) {
  const map::VoxelBox anew = grown(changed, kAhead, 0, size());
  const Marks marks = entered(changed, listed);
  const std::vector<std::size_t> met = tiles_.meeting(anew);
  std::vector<std::shared_ptr<Tile>> fresh(met.size());
  std::vector<Tile*> of_tile(tiles_.count(), nullptr);
  parallel(met.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      fresh[n] = std::make_shared<Tile>(renumbered(met[n], changed, marks));
      of_tile[met[n]] = fresh[n].get();
    }
  });
  fill([&](std::size_t n, const BoundCodes& codes) {
    const Index3 v = map::voxel(size(), n);
    Tile& tile = *of_tile[tiles_.holding(v)];
    tile.entries[tile.entry_of(Grid::within(v))].level[0] = codes;
  });
  const auto nothing = std::make_shared<const Tile>();
  for (std::size_t n = 0; n < met.size(); ++n)
    tiles_.replace(met[n], fresh[n]->entries.size() > 1 ? std::shared_ptr<const Tile>(fresh[n]) : nothing);
  parallel(met.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      if (fresh[n]->entries.size() > 1) pool(*fresh[n], map::common(tiles_.voxels(met[n]), anew));
  });
}

// Those that a tile's cubes reach, in rising order, itself first.
std::vector<std::size_t> BoundTiles::reached(std::size_t tile) const {
  return tiles_.meeting(grown(tiles_.voxels(tile), 0, kAhead, size()));
}

// A tile that is no other's; its codes are those of before, or fresh.
BoundTiles::Tile& BoundTiles::own(std::size_t tile, const Fresh& fresh) {
  const auto own = fresh[tile] ? fresh[tile] : std::make_shared<Tile>(tiles_[tile]);
  tiles_.replace(tile, own);
  return *own;
}

// Pools a tile again if one of those that it reaches is fresh. False, and nothing is done, if one of them has a number
// from `end` on: another thread may be writing it.
bool BoundTiles::pool_before(std::size_t end, std::size_t tile, const Fresh& fresh) {
  if (tiles_[tile].entries.size() <= 1) return true;
  const std::vector<std::size_t> all = reached(tile);
  if (all.back() >= end) return false;
  if (std::ranges::any_of(all, [&](std::size_t n) { return fresh[n] != nullptr; }))
    pool(own(tile, fresh), tiles_.voxels(tile));
  return true;
}

void BoundTiles::pool_rest(const std::vector<std::uint8_t>& pooled, const Fresh& fresh, const Parallel& parallel) {
  std::vector<std::pair<std::size_t, Tile*>> rest;
  for (std::size_t tile = 0; tile < pooled.size(); ++tile)
    if (!pooled[tile] && std::ranges::any_of(reached(tile), [&](std::size_t n) { return fresh[n] != nullptr; }))
      rest.emplace_back(tile, &own(tile, fresh));
  parallel(rest.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) pool(*rest[n].second, tiles_.voxels(rest[n].first));
  });
}

// The cube of a level is the union of the eight cubes of the level below at its octants.
void BoundTiles::pool(Tile& tile, const map::VoxelBox& box) const {
  const map::VoxelBox read = grown(box, 0, kAhead, size());
  const Index3 extent = read.high - read.low + Index3::Ones();
  std::vector<Padded> codes(static_cast<std::size_t>(extent.prod()));
  std::size_t n = 0;
  for_each_entry(read,
                 [&](const Entry& entry) { std::memcpy(&codes[n++].codes, &entry.level[0], sizeof(BoundCodes)); });
  for (std::size_t level = 1; level < kLevels; ++level) {
    join_ahead(codes, extent, 1 << (level - 1),
               [](const Padded& a, const Padded& b) { return Padded{a.codes > b.codes ? a.codes : b.codes}; });
    map::for_each_voxel(box, [&](const Index3& v) {
      const std::size_t e = tile.entry_of(Grid::within(v));
      if (e)
        std::memcpy(&tile.entries[e].level[level], &codes[map::linear(extent, v - read.low)].codes, sizeof(BoundCodes));
    });
  }
  tile.largest = {};
  for (const Entry& e : tile.entries) raise(tile.largest, e.level[0]);
}

BoundCodes BoundTiles::largest() const noexcept {
  BoundCodes largest{};
  for (std::size_t n = 0; n < tiles_.count(); ++n) raise(largest, tiles_[n].largest);
  return largest;
}

}  // namespace backwash::reach

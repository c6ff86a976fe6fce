// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/bound_tiles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace backwash::reach {
namespace {

/// Codes that are kept voxel by voxel.
struct Plain {
  Index3 size;
  std::vector<BoundCodes> codes;
  BoundCodes largest(const Index3& low, int edge) const {
    BoundCodes most{};
    map::for_each_voxel({low, (low + Index3::Constant(edge - 1)).cwiseMin(size - Index3::Ones())},
                        [&](const Index3& v) {
                          for (std::size_t d = 0; d < kDirections; ++d)
                            most[d] = std::max(most[d], codes[map::linear(size, v)][d]);
                        });
    return most;
  }
};

/// New codes at some voxels of a box, none at its others.
void change(BoundTiles& tiles, Plain& plain, const map::VoxelBox& box, std::mt19937& random) {
  std::vector<std::size_t> listed;
  map::for_each_voxel(box, [&](const Index3& v) {
    BoundCodes& codes = plain.codes[map::linear(plain.size, v)];
    codes = {};
    if (random() % 3 == 0) return;
    listed.push_back(map::linear(plain.size, v));
    for (BoundCode& code : codes) code = static_cast<BoundCode>(1 + random() % 65535);
  });
  const auto fill = [&](const auto& store) {
    for (const std::size_t n : listed) store(n, plain.codes[n]);
  };
  tiles.update(box, listed, fill, run_serial);
}

void expect_same(const BoundTiles& tiles, const Plain& plain) {
  BoundCodes largest{};
  for (std::size_t n = 0; n < plain.codes.size(); ++n) {
    const Index3 v = map::voxel(plain.size, n);
    for (int level = 0; level < BoundTiles::kLevels; ++level)
      ASSERT_EQ(tiles.at(v).level[static_cast<std::size_t>(level)], plain.largest(v, 1 << level))
          << v.transpose() << ", level " << level;
    for (std::size_t d = 0; d < kDirections; ++d) largest[d] = std::max(largest[d], plain.codes[n][d]);
  }
  ASSERT_EQ(tiles.largest(), largest);
}

TEST(BoundTiles, HoldTheMaximaOfAllCubesWhateverChangedAndCopiesStayAsTheyWere) {
  std::mt19937 random(4);
  for (const Index3& size : {Index3(37, 21, 18), Index3(16, 16, 16), Index3(3, 2, 1)}) {
    BoundTiles tiles(size);
    Plain plain{size, std::vector<BoundCodes>(static_cast<std::size_t>(size.prod()))};
    expect_same(tiles, plain);
    for (int round = 0; round < 12; ++round) {
      const BoundTiles old = tiles;
      const Plain before = plain;
      map::VoxelBox box;
      for (int corner = 0; corner < 2; ++corner) box.add(map::voxel(size, random() % plain.codes.size()));
      if (round == 0) box = map::all_of(size);
      change(tiles, plain, box, random);
      expect_same(tiles, plain);
      if (round % 4 == 3) expect_same(old, before);
    }
  }
}

}  // namespace
}  // namespace backwash::reach

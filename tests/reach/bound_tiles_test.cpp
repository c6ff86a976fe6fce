// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/bound/bound_tiles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
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

/// Ranges of a few at a time, in an order that is not the rising one: what a range does must not depend on others.
void run_in_pieces(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) {
  constexpr std::size_t kPiece = 3;
  for (std::size_t first = 0; first < 2; ++first)
    for (std::size_t n = first * kPiece; n < count; n += 2 * kPiece) work(n, std::min(n + kPiece, count));
}

TEST(BoundTiles, OtherCodesAreThoseOfAnUpdateOfAllAndWhatNoneReachesStaysShared) {
  std::mt19937 random(5);
  const Index3 size(70, 37, 21);
  for (const Parallel& parallel : {Parallel(run_serial), Parallel(run_in_pieces)})
    for (const bool everywhere : {true, false}) {
      BoundTiles tiles(size);
      Plain plain{size, std::vector<BoundCodes>(static_cast<std::size_t>(size.prod()))};
      change(tiles, plain, map::all_of(size), random);
      const BoundTiles old = tiles;
      const Plain before = plain;
      // Where codes have an odd sum, or in one corner of one tile: its lowest, which cubes of seven others reach.
      const map::VoxelBox corner{{48, 16, 16}, {48, 16, 16}};
      const auto anew = [&](std::size_t n, const BoundCodes& codes) {
        EXPECT_EQ(codes, before.codes[n]);
        if (everywhere ? (codes[0] + codes[1]) % 2 == 0 : !corner.contains(map::voxel(size, n))) return codes;
        BoundCodes other = codes;
        for (BoundCode& code : other) code = static_cast<BoundCode>(std::max(1, everywhere ? code / 2 : 65535));
        return other;
      };
      for (std::size_t n = 0; n < plain.codes.size(); ++n)
        if (plain.codes[n] != BoundCodes{}) plain.codes[n] = anew(n, plain.codes[n]);
      tiles.recode(anew, parallel);
      expect_same(tiles, plain);
      expect_same(old, before);
      const auto shared = [&](const Index3& v) { return &tiles.at(v) == &old.at(v); };
      if (!everywhere) {
        EXPECT_TRUE(shared({5, 5, 5}));
        EXPECT_TRUE(shared({65, 30, 20}));
      }
    }
}

}  // namespace
}  // namespace backwash::reach

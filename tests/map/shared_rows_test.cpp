// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/shared_rows.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <vector>

namespace backwash::map {
namespace {

using Rows = SharedRows<std::uint16_t>;

Index3 drawn_size(std::mt19937& random) {
  const auto draw = [&](int most) { return std::uniform_int_distribution(1, most)(random); };
  return {draw(600), draw(40), draw(20)};
}

std::vector<std::uint16_t> cells_of(const Rows& rows) {
  std::vector<std::uint16_t> cells;
  for_each_voxel(all_of(rows.size()), [&](const Index3& v) { cells.push_back(rows[v]); });
  return cells;
}

VoxelBox drawn_box(std::mt19937& random, const Index3& size) {
  VoxelBox box;
  for (int end = 0; end < 2; ++end)
    box.add({std::uniform_int_distribution(0, size.x() - 1)(random),
             std::uniform_int_distribution(0, size.y() - 1)(random),
             std::uniform_int_distribution(0, size.z() - 1)(random)});
  return box;
}

// Snapshots of a grid that changes box by box, each beside a plain array of its own.
TEST(SharedRows, KeepWhatASnapshotHeldWhateverIsWrittenLater) {
  std::mt19937 random(5);
  for (int round = 0; round < 30; ++round) {
    const Index3 size = drawn_size(random);
    std::vector<Rows> snapshots{Rows(size, 7)};
    std::vector<std::vector<std::uint16_t>> expected{
        std::vector<std::uint16_t>(static_cast<std::size_t>(size.prod()), 7)};
    for (int n = 0; n < 6; ++n) {
      const std::size_t from = random() % snapshots.size();
      Rows rows = snapshots[from];
      auto cells = expected[from];
      const VoxelBox box = drawn_box(random, size);
      rows.own(box);
      for_each_voxel(box, [&](const Index3& v) {
        const auto value = static_cast<std::uint16_t>(random());
        rows.own_row(v.y(), v.z())[v.x()] = cells[linear(size, v)] = value;
      });
      snapshots.push_back(std::move(rows));
      expected.push_back(std::move(cells));
      for (std::size_t s = 0; s < snapshots.size(); ++s)
        ASSERT_TRUE(cells_of(snapshots[s]) == expected[s]) << "snapshot " << s << " of " << size.transpose();
    }
  }
}

TEST(SharedRows, HoldWhatDidNotChangeOnce) {
  const Index3 size(200, 100, 30);
  const Rows before(size);
  Rows after = before;
  const VoxelBox box{{90, 40, 10}, {110, 60, 20}};
  after.own(box);
  int shared = 0;
  for (int k = 0; k < size.z(); ++k)
    for (int j = 0; j < size.y(); ++j) {
      const bool same = after.row(j, k) == before.row(j, k);
      if (box.contains({box.low.x(), j, k})) {
        ASSERT_FALSE(same) << j << ' ' << k;
      }
      shared += same;
    }
  EXPECT_GT(shared, 2200);  // of 3000, 231 of which are the box's
}

}  // namespace
}  // namespace backwash::map

// SPDX-License-Identifier: BSD-3-Clause
// docs/faults.md rows 11, 12, 27: maps and scans, whatever their bytes and sizes say.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/map/octomap/octomap_message.hpp"
#include "services/backwashd/map/cloud.hpp"
#include "tests/fuzz/mutator.hpp"
#include "tests/support/write_octomap.hpp"

namespace backwash::fuzz {
namespace {

constexpr std::size_t kCap = 1U << 20;

/// A small world's tree, from almost empty to almost full.
map::OccupancyGrid some_grid(Mutator& mutator) {
  const auto side = [&] { return 1 + static_cast<int>(mutator.below(12)); };
  map::OccupancyGrid grid({0, 0, 0}, 0.1, {side(), side(), side()}, static_cast<map::Cell>(mutator.below(3)));
  const std::size_t density = 1 + mutator.below(20);
  for (std::size_t i = 0; i < grid.cell_count(); ++i)
    if (mutator.one_in(density)) grid.set(grid.voxel(i), static_cast<map::Cell>(mutator.below(3)));
  return grid;
}

Bytes unsigned_bytes(const std::vector<std::int8_t>& data) { return {data.begin(), data.end()}; }

TEST(Fuzz, AMapMessageIsRefusedOrFitsItsCap) {
  Mutator mutator("octomap message", 0.2);
  std::uint64_t taken = 0;
  for (bool more = true; more;) {
    const bool binary = !mutator.one_in(3);
    Bytes bytes = binary ? unsigned_bytes(map::encode_octomap(some_grid(mutator))) : mutator.noise(mutator.below(200));
    bytes = mutator.damaged(bytes);
    more = mutator.spend(bytes.size() + 1);
    const std::vector<std::int8_t> data(bytes.begin(), bytes.end());
    const auto grid = map::decode_octomap(data, 0.1, binary, "OcTree", kCap);
    taken += grid.has_value();
    if (!grid) {
      ASSERT_FALSE(grid.error().message.empty());
      continue;
    }
    ASSERT_LE(grid->cell_count() * sizeof(map::Cell), kCap);
    ASSERT_EQ(grid->cell_count(), grid->cells().size());
    ASSERT_TRUE(grid->origin().allFinite());
  }
  std::printf("%llu messages, %llu taken\n", static_cast<unsigned long long>(mutator.inputs()),
              static_cast<unsigned long long>(taken));
  EXPECT_GT(taken, 0u);
  EXPECT_LT(taken, mutator.inputs());
}

TEST(Fuzz, AMapFileIsRefusedOrFitsItsCap) {
  Mutator mutator("octomap file", 0.02);
  const std::string path = testing::TempDir() + "fuzz_" + std::to_string(::getpid()) + ".bt";
  std::uint64_t taken = 0;
  for (bool more = true; more;) {
    ASSERT_TRUE(map::write_octomap(some_grid(mutator), path));
    std::ifstream in(path, std::ios::binary);
    const Bytes bytes = mutator.damaged({std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()});
    more = mutator.spend(bytes.size());
    std::ofstream(path, std::ios::binary | std::ios::trunc)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    const auto grid = map::load_octomap(path, kCap);
    taken += grid.has_value();
    if (grid) {
      ASSERT_LE(grid->cell_count() * sizeof(map::Cell), kCap);
    }
  }
  std::filesystem::remove(path);
  std::printf("%llu files, %llu taken\n", static_cast<unsigned long long>(mutator.inputs()),
              static_cast<unsigned long long>(taken));
  EXPECT_LT(taken, mutator.inputs());
}

// The address sanitizer of the nightly build sees any read outside of the data.
TEST(Fuzz, AScanIsRefusedOrEveryPointOfItIsFinite) {
  Mutator mutator("point cloud", 0.2);
  std::uint64_t taken = 0;
  for (bool more = true; more;) {
    Bytes data = mutator.noise(mutator.below(600));
    const auto field = [&](const char* name, std::uint32_t offset) {
      return dds::PointField{const_cast<char*>(name), offset, static_cast<std::uint8_t>(7 + mutator.below(2)), 1};
    };
    std::array fields{field("x", 0),     field("y", 4),     field("z", 8),
                      field("vp_x", 12), field("vp_y", 16), field("vp_z", 20)};
    dds::PointCloud m{};
    m.point_step = static_cast<std::uint32_t>(12 + mutator.below(40));
    m.width = static_cast<std::uint32_t>(mutator.below(20));
    m.height = static_cast<std::uint32_t>(1 + mutator.below(3));
    m.row_step = m.width * m.point_step;
    std::array<std::uint32_t*, 6> sizes{&m.point_step, &m.width,          &m.height,
                                        &m.row_step,   &fields[0].offset, &fields[5].offset};
    for (auto* size : sizes)
      if (mutator.one_in(12)) *size = static_cast<std::uint32_t>(mutator.bits()) >> mutator.below(32);
    for (auto& f : fields) {
      if (mutator.one_in(20)) f.datatype = static_cast<std::uint8_t>(mutator.bits());
      if (mutator.one_in(40)) f.name = nullptr;
      if (mutator.one_in(40)) f.count = static_cast<std::uint32_t>(mutator.bits());
    }
    const auto columns = static_cast<std::uint32_t>(3 + mutator.below(4));
    m.fields = {columns, columns, fields.data(), false};
    m.data = {static_cast<std::uint32_t>(data.size()), static_cast<std::uint32_t>(data.size()), data.data(), false};
    more = mutator.spend(data.size() + 1);
    const auto cloud = daemon::decode_cloud(m);
    if (!cloud) continue;
    taken += !cloud->points.empty();
    ASSERT_LE(cloud->points.size(), daemon::kMaxCloudPoints);
    for (const Vec3& p : cloud->points) ASSERT_TRUE(p.allFinite());
    ASSERT_TRUE(!cloud->viewpoint || cloud->viewpoint->allFinite());
  }
  std::printf("%llu scans, %llu taken with points\n", static_cast<unsigned long long>(mutator.inputs()),
              static_cast<unsigned long long>(taken));
  EXPECT_GT(taken, 0u);
  EXPECT_LT(taken, mutator.inputs());
}

}  // namespace
}  // namespace backwash::fuzz

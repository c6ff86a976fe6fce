// SPDX-License-Identifier: BSD-3-Clause
// What a world holds, by counting what is allocated: the table of docs/measurements/world_memory.md is read and held
// against it.
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <new>
#include <sstream>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/world/world.hpp"
#include "tests/bench/furnished_room.hpp"

namespace {

std::atomic<long> held{0};  // bytes

void* hold(std::size_t size, std::size_t alignment) {
  void* const p = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (!p) throw std::bad_alloc();
  held += static_cast<long>(malloc_usable_size(p));
  return p;
}

void release(void* p) noexcept {
  held -= static_cast<long>(malloc_usable_size(p));
  std::free(p);
}

}  // namespace

void* operator new(std::size_t size) { return hold(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t a) { return hold(size, static_cast<std::size_t>(a)); }
void operator delete(void* p) noexcept { release(p); }
void operator delete(void* p, std::size_t) noexcept { release(p); }
void operator delete(void* p, std::align_val_t) noexcept { release(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { release(p); }

namespace backwash::plan {
namespace {

/// What a structure holds: copies share it, so that it is counted as it is made.
template <class Make>
double bytes_of(const Make& make) {
  const long before = held;
  const auto structure = make();
  return static_cast<double>(held - before);
}

/// Bytes per voxel of a map's world, quad-5in and its model, in the table's order.
std::vector<double> bytes_per_voxel(const map::OccupancyGrid& grid) {
  const Vehicle vehicle = *config::load_vehicle("builtin:quad-5in");
  const long before = held;
  const auto world = build_world(grid, *config::load_model("builtin:quad-5in"), vehicle);
  const auto all = static_cast<double>(held - before);
  const auto copy = [](const auto& structure) { return bytes_of([&] { return structure; }); };
  const double distance = bytes_of([&] { return map::DistanceField(world->grid); });
  const double rest = distance + copy(world->grid) + copy(world->hover) + copy(world->reach);
  const double sums = bytes_of([&] { return map::OccupancySums(world->grid); });
  const double safe = bytes_of([&] { return SafeSpace(world->hover.safe_voxels()); });
  std::vector<double> bytes = {all - rest - sums - safe, distance,           sums, safe, copy(world->grid),
                               copy(world->hover),       copy(world->reach), all};
  for (double& b : bytes) b /= static_cast<double>(world->grid.cell_count());
  return bytes;
}

/// A column of the document's table, from the row of bounds on to that of all.
std::vector<double> documented(int column) {
  std::ifstream document(BACKWASH_SOURCE_DIR "/docs/measurements/world_memory.md");
  std::vector<double> values;
  bool within = false;
  for (std::string line; std::getline(document, line);) {
    within = within || line.starts_with("| bounds, ");
    if (!within || !line.starts_with("|")) continue;
    std::istringstream cells(line);
    std::string cell;
    for (int n = 0; n <= column; ++n) std::getline(cells, cell, '|');
    values.push_back(std::stod(cell));
    if (line.starts_with("| all ")) break;
  }
  return values;
}

void expect_documented(const std::vector<double>& bytes, int column) {
  const auto expected = documented(column);
  ASSERT_EQ(bytes.size(), expected.size());
  for (std::size_t n = 0; n < bytes.size(); ++n) EXPECT_NEAR(bytes[n], expected[n], 0.06) << "row " << n;
}

TEST(MemoryOfAWorld, IsThatOfTheTable) { expect_documented(bytes_per_voxel(bench::furnished_room(0.1)), 3); }

TEST(MemoryOfAWorld, OfABuildingIsThatOfTheTable) {
  const std::string file = BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt";
  expect_documented(bytes_per_voxel(*map::load_map(file)), 4);
}

// Two worlds live while a map changes: the second holds what differs, and map and hover map, 2 bytes a voxel.
TEST(MemoryOfAWorld, TwoOfABuildingInWhichACubicMetreChangedShareMostOfOne) {
  const std::string file = BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt";
  const Model model = *config::load_model("builtin:quad-5in");
  const long none = held;
  const auto world = build_world(*map::load_map(file), model, *config::load_vehicle("builtin:quad-5in"));
  const long one = held;
  map::OccupancyGrid grid = world->grid;
  Index3 low = grid.size() / 2;
  while (!world->hover.safe(low)) low.x() = (low.x() + 1) % grid.size().x();
  const int edge = static_cast<int>(1 / grid.resolution());
  map::VoxelBox changed{low, (low + Index3::Constant(edge - 1)).cwiseMin(grid.size() - Index3::Ones())};
  map::for_each_voxel(changed, [&](const Index3& v) { grid.set(v, map::Cell::occupied); });
  const auto updated = rebuilt(*world, {.grid = std::move(grid), .voxels = changed});
  const double growth = static_cast<double>(held - one) / static_cast<double>(one - none);
  std::printf("a cubic metre: %.3f of the world more\n", growth);
  EXPECT_LT(growth, 0.3);
}

}  // namespace
}  // namespace backwash::plan

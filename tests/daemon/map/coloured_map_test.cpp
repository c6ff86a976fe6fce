// SPDX-License-Identifier: BSD-3-Clause
// A mapper's octree of colours, made by liboctomap itself.
#include <octomap/ColorOcTree.h>

#include <sstream>

#include "core/report/recorded_map.hpp"
#include "tests/daemon/map/map_worker_rig.hpp"

namespace backwash::daemon {
namespace {

/// The map's full stream, which has three bytes of a colour beside each log-odds.
std::vector<std::int8_t> coloured(const map::OccupancyGrid& grid) {
  octomap::ColorOcTree tree(grid.resolution());
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Eigen::Vector3f p = grid.center(grid.voxel(n)).cast<float>();
    if (grid.at(n) == map::Cell::unknown) continue;
    tree.updateNode(octomap::point3d(p.x(), p.y(), p.z()), grid.at(n) == map::Cell::occupied, true)->setColor(9, 8, 7);
  }
  tree.updateInnerOccupancy();
  std::stringstream stream;
  tree.writeData(stream);
  const std::string text = stream.str();
  return {text.begin(), text.end()};
}

void expect_same(const map::OccupancyGrid& got, const map::OccupancyGrid& wanted) {
  for (std::size_t n = 0; n < wanted.cell_count(); ++n) {
    const Vec3 p = wanted.center(wanted.voxel(n));
    ASSERT_EQ(got.at(got.index(p)), wanted.at(n)) << p.transpose();
  }
}

TEST_F(MapWorkerTest, AMapOfColoursIsUsedAndItsOccupancyIsInTheLog) {
  const auto data = coloured(grid_);
  channels_->maps.offer(
      std::make_unique<const MapMessage>(MapMessage{data, grid_.resolution(), false, "ColorOcTree", 1}));
  EXPECT_TRUE(worker_.step());
  ASSERT_NE(world(), nullptr);
  EXPECT_EQ(channels_->maps_accepted, 1u);
  expect_same(world()->grid, grid_);
  channels_->maps.offer(std::make_unique<const MapMessage>(
      MapMessage{{data.begin(), data.end() - 2}, grid_.resolution(), false, "ColorOcTree", 2}));
  EXPECT_TRUE(worker_.step());
  EXPECT_EQ(channels_->maps_rejected, 1u) << "cut within its last node";
  recorder_.drain(*channels_);
  const auto log = log::read_raw_log(log_);
  ASSERT_TRUE(log) << log.error().message;
  const auto recorded = report::recorded_map(log->records);
  ASSERT_TRUE(recorded) << recorded.error().message;
  expect_same(*recorded, grid_);
}

}  // namespace
}  // namespace backwash::daemon

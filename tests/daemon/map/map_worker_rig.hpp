// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/map/octomap/octomap_message.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/map/map_worker.hpp"

namespace backwash::daemon {

/// Whether the point is in one of the boxes.
inline bool holds(const NewVoxels& voxels, const Vec3& p) {
  for (std::size_t n = 0; n < voxels.count; ++n) {
    const auto& [x, y, z] = voxels.centers[n];
    const auto& [i, j, k] = voxels.more[n];
    const Vec3 half = voxels.edge / 2 * Vec3(1 + i, 1 + j, 1 + k);
    if (((p - Vec3(x, y, z)).cwiseAbs().array() <= half.array() + 1e-9).all()) return true;
  }
  return false;
}

/// A map worker alone; the test plays its senders and the control thread.
class MapWorkerTest : public testing::Test {
 protected:
  std::string log_ = std::filesystem::temp_directory_path() / ("backwash_map_worker." + std::to_string(getpid()));
  std::unique_ptr<Channels> channels_ = std::make_unique<Channels>();
  Recorder recorder_{log_};
  MapSettings settings_;
  MapWorker worker_{*channels_, recorder_, Model{}, config::load_vehicle("builtin:quad-5in").value(), settings_};
  map::OccupancyGrid grid_ = map::builtin_scene("parallel-walls-2m", 0.2).value();
  const Snapshot* held_ = nullptr;

  ~MapWorkerTest() override {
    channels_->worlds.control.give_back(held_);
    channels_->worlds.collect();
    std::filesystem::remove(log_);
  }
  void send(std::vector<std::int8_t> data, double resolution, std::int64_t received_ns = 1) {
    channels_->maps.offer(
        std::make_unique<const MapMessage>(MapMessage{std::move(data), resolution, true, "OcTree", received_ns}));
    EXPECT_TRUE(worker_.step());
  }
  void send(const map::OccupancyGrid& grid, std::int64_t received_ns = 1) {
    send(map::encode_octomap(grid), grid.resolution(), received_ns);
  }
  /// The newest world that the control thread was handed, or the one from before.
  const plan::World* world() {
    if (const auto* newest = channels_->worlds.control.take())
      channels_->worlds.control.give_back(std::exchange(held_, newest));
    return held_ ? held_->world.get() : nullptr;
  }
  void scan(const std::vector<Vec3>& points, const Vec3& sensor, std::int64_t received_ns) {
    EXPECT_TRUE(channels_->scans.push(new Scan{points, sensor, received_ns}));
    EXPECT_TRUE(worker_.step() || channels_->scans_rejected > 0);
  }
};

}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <malloc.h>

#include <functional>

#include "tests/daemon/map/map_worker_rig.hpp"

namespace backwash::daemon {

inline MapSettings with_window(std::size_t keep_parts, double max_mib = 512) {
  MapSettings settings;
  settings.max_mib = max_mib;
  settings.window = {
      "rt/occ", "rt/free", {2, 2, 2}, 0.2, static_cast<double>(keep_parts * map::SeenWindow::kPartVoxels)};
  return settings;
}

class MapWindowTest : public MapWorkerTest {
 protected:
  void begin(const MapSettings& settings) {
    settings_ = settings;
    worker_now_.emplace(*channels_, recorder_, Model{}, config::load_vehicle("builtin:quad-5in").value(), settings);
  }
  bool step() { return worker_now_->step(); }
  void whole(const map::OccupancyGrid& grid, std::int64_t at_ns = 1) {
    channels_->maps.offer(std::make_unique<const MapMessage>(
        MapMessage{map::encode_octomap(grid), grid.resolution(), true, "OcTree", at_ns}));
    step();
  }
  void vehicle(const Vec3& p) {
    vehicle_ = p;
    channels_->vehicle_W.write(p);
  }
  /// A cloud of those voxels of the window around the vehicle for which `listed` holds, by their centres.
  void say(bool free, std::int64_t at_ns, const std::function<bool(const Vec3&)>& listed, bool first = false) {
    auto cloud = std::make_unique<WindowCloud>();
    const Index3 size = settings_.window.voxels();
    cloud->free = free;
    cloud->first = first;
    cloud->window.low = (vehicle_ / 0.2 - size.cast<double>() / 2).array().round().cast<int>();
    cloud->window.high = cloud->window.low + size - Index3::Ones();
    cloud->stamp_ns = cloud->received_ns = at_ns;
    map::for_each_voxel(cloud->window, [&](const Index3& v) {
      if (listed(0.2 * (v.cast<double>() + Vec3::Constant(0.5)))) cloud->voxels.push_back(v);
    });
    ASSERT_TRUE(channels_->windows.push(cloud.release()));
    if (!waits_) step();
  }
  /// A scan that looks along x through kSeenAt.
  void look_through(std::int64_t at_ns) {
    EXPECT_TRUE(channels_->scans.push(new Scan{{{1.9, 0.1, 1.1}}, {-0.5, 0.1, 1.1}, at_ns}));
  }
  map::Cell at(const Vec3& p) { return world()->grid.at(world()->grid.index(p)); }
  void expect_as_built() {
    Model model;
    model.unknown_floor = true;
    const auto built = plan::build_world(world()->grid, model, config::load_vehicle("builtin:quad-5in").value());
    EXPECT_TRUE(std::ranges::equal(built->grid.cells(), world()->grid.cells()));
    EXPECT_TRUE(std::ranges::equal(built->hover.safe_voxels().cells(), world()->hover.safe_voxels().cells()));
    std::size_t differ = 0;
    for (std::size_t n = 0; n < built->grid.cell_count(); ++n)
      differ += built->bounds.at(built->grid.voxel(n)).w != world()->bounds.at(built->grid.voxel(n)).w;
    EXPECT_EQ(differ, 0u);
  }
  std::size_t bytes() const { return mallinfo2().uordblks + mallinfo2().hblkhd; }

  std::optional<MapWorker> worker_now_;
  Vec3 vehicle_ = Vec3::Zero();
  bool waits_ = false;  // the worker is busy meanwhile
};

inline const Vec3 kSeenAt(0.5, 0.1, 1.1), kWallAt(0.5, 1.1, 1.1);

inline bool same_voxel(const Vec3& p, const Vec3& q) { return (p - q).cwiseAbs().maxCoeff() < 0.05; }

}  // namespace backwash::daemon

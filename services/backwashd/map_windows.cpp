// SPDX-License-Identifier: BSD-3-Clause
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "services/backwashd/map_change.hpp"
#include "services/backwashd/map_worker.hpp"

namespace backwash::daemon {

void MapWorker::tell_let_go(const WindowKeeper::Changes& changes) {
  if (changes.let_go == 0) return;
  const std::string line = "window: " + std::to_string(changes.let_go) + " voxels far from it are let go, " +
                           std::to_string(changes.let_go_blocks) +
                           " of them occupied: the last whole map speaks for them";
  recorder_.append(log::RecordKind::world, line);
  spdlog::info("{} ({} parts are held)", line, window_->parts());
}

void MapWorker::look_at(map::OccupancyGrid grid) {
  map::LiveMap live(std::move(grid));
  if (live_)
    live.take_along(
        *live_,
        ((live.grid().origin() - live_->grid().origin()) / live.grid().resolution()).array().round().cast<int>());
  live_.emplace(std::move(live));
  said_ = gone_ = {};
}

/// A world at another place, where the vehicle has come to the edge of the one in use, or anew of what is known. False:
/// there is no need, or nothing to make one of.
bool MapWorker::move_world(bool anew) {
  if (const auto newest = channels_.vehicle_W.read_new()) vehicle_W_ = *newest;
  if (!vehicle_W_) return false;
  auto grid = window_->moved(*vehicle_W_, live_ && !anew ? &live_->grid() : nullptr);
  if (!grid) return false;
  const auto begun = now_ns();
  const std::int64_t seen_ns = std::max(heard_ns_, channels_.map_ns.load().value_or(0));
  look_at(std::move(*grid));
  if (world_) tell_control(news(world_->grid, live_->grid(), seen_ns));
  channels_.world_moves = true;
  publish(built(live_->grid()), seen_ns);
  const Index3& size = world_->grid.size();
  spdlog::info("world of the window made around the vehicle: {} x {} x {} voxels in {} ms", size.x(), size.y(),
               size.z(), (now_ns() - begun) / 1'000'000);
  return true;
}

void MapWorker::note(const map::ScanChange& change, map::VoxelBox& box, std::int64_t received_ns) {
  if (change.box.empty()) return;
  box.add(change.box.low);
  box.add(change.box.high);
  if (!world_) return;
  for (const Index3& v : change.occupied) noted_.push_back(world_->grid.index(live_->grid().center(v)));
  noted_ns_ = std::max(noted_ns_, received_ns);
}

void MapWorker::take_cloud(const WindowCloud& cloud) {
  if (!window_) return;
  const auto changes = window_->take(cloud, live_ ? &*live_ : nullptr);
  ++channels_.scans_accepted;
  tell_let_go(changes);
  note(changes.said, said_, cloud.received_ns);
  note(changes.gone, gone_, cloud.received_ns);
  if (!cloud.free) heard_ns_ = std::max(heard_ns_, cloud.received_ns);
}

void MapWorker::take_scan(const Scan& scan) {
  // What was found before a loop closure lies where the map was then: the next map speaks for it.
  if (std::exchange(closures_, scan.closures) != scan.closures && live_) live_->forget_found();
  if (!live_ || !live_->grid().inside(live_->grid().index(scan.sensor_W))) {
    ++channels_.scans_rejected;  // no map yet, or the sensor is outside of it
    return;
  }
  note(live_->insert(scan.points_W, scan.sensor_W, settings_.sensor_range), said_, scan.received_ns);
  ++channels_.scans_accepted;
  heard_ns_ = std::max(heard_ns_, scan.received_ns);
}

/// In the order in which they came: the last word counts. One thread hands them over. None is left that came before one
/// that is taken. The age of the map is that of the newest scan, occupied cloud or map: free voxels alone say nothing
/// of what has come.
bool MapWorker::hear() {
  std::vector<std::unique_ptr<Scan>> scans;
  std::vector<std::unique_ptr<WindowCloud>> clouds;
  for (bool more = true; std::exchange(more, false);) {
    while (const auto next = channels_.windows.pop()) clouds.emplace_back(*next);
    while (const auto next = channels_.scans.pop()) {
      scans.emplace_back(*next);
      more = true;
    }
  }
  auto cloud = clouds.begin();
  const auto clouds_before = [&](std::int64_t ns) {
    for (; cloud != clouds.end() && (*cloud)->received_ns < ns; ++cloud) take_cloud(**cloud);
  };
  for (const auto& scan : scans) {
    clouds_before(scan->received_ns);
    take_scan(*scan);
  }
  clouds_before(INT64_MAX);
  if (!noted_.empty()) tell_control(news(world_->grid, std::exchange(noted_, {}), noted_ns_));  // in one record
  return !scans.empty() || !clouds.empty();
}

/// Scans and clouds that came meanwhile are in one world together.
bool MapWorker::take_news() {
  const auto begun = now_ns();
  const bool heard = hear();
  // Without news the vehicle may have come to the edge of its world all the same.
  if (window_ && move_world(false)) return true;
  const std::int64_t seen_ns = std::max(heard_ns_, channels_.map_ns.load().value_or(heard_ns_));
  const std::array boxes{std::exchange(said_, {}), std::exchange(gone_, {})};
  if (!boxes[0].empty() || !boxes[1].empty()) {
    const auto update = [&, grid = live_->grid()] {
      World world = world_;
      for (const map::VoxelBox& box : boxes)
        if (!box.empty()) world = plan::update_world(*world, grid, box, model_, parallel_);
      return world;
    };
    publish(made(update), seen_ns);
    spdlog::debug("map updated in {} ms", (now_ns() - begun) / 1'000'000);
    return true;
  }
  if (heard && world_ && seen_ns > channels_.map_ns.load()) publish(world_, seen_ns);  // it says what they say
  return heard;
}

}  // namespace backwash::daemon

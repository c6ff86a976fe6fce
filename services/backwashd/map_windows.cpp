// SPDX-License-Identifier: BSD-3-Clause
#include <spdlog/spdlog.h>

#include <algorithm>
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

/// A world at another place, where the vehicle has come to the edge of the one in use, or anew of what is known. False:
/// there is no need, or nothing to make one of.
bool MapWorker::move_world(bool anew, std::int64_t seen_ns) {
  if (const auto newest = channels_.vehicle_W.read_new()) vehicle_W_ = *newest;
  if (!vehicle_W_) return false;
  const bool along = live_ && !anew;
  auto grid = window_->moved(*vehicle_W_, along ? &live_->grid() : nullptr);
  if (!grid) return false;
  const auto begun = now_ns();
  const Index3 size = grid->size();
  map::LiveMap live(*grid);
  if (along)
    live.take_along(*live_,
                    ((grid->origin() - live_->grid().origin()) / grid->resolution()).array().round().cast<int>());
  live_.emplace(std::move(live));
  channels_.world_moves = true;
  publish(made(std::move(*grid)), seen_ns);
  spdlog::info("world of the window made around the vehicle: {} x {} x {} voxels in {} ms", size.x(), size.y(),
               size.z(), (now_ns() - begun) / 1'000'000);
  return true;
}

void MapWorker::take_cloud(const WindowCloud& cloud, map::VoxelBox& said, map::VoxelBox& gone) {
  if (!window_) return;
  const auto changes = window_->take(cloud, live_ ? &*live_ : nullptr);
  ++channels_.scans_accepted;
  tell_let_go(changes);
  for (const auto& [change, box] : {std::pair(&changes.said, &said), std::pair(&changes.gone, &gone)}) {
    if (change->box.empty()) continue;
    if (!change->occupied.empty()) channels_.map_voxels.push(as_new_voxels(world_->grid, *change, cloud.received_ns));
    box->add(change->box.low);
    box->add(change->box.high);
  }
}

/// Scans and clouds that came meanwhile are taken in together, in the order in which they came: the last word counts.
/// One thread hands them over. None is left that came before one that is taken, so that a snapshot holds all that is
/// older than it says. The age of the map is that of the newest scan or occupied cloud: free voxels alone say nothing
/// of what has come.
bool MapWorker::take_news() {
  const auto begun = now_ns();
  std::vector<std::unique_ptr<Scan>> scans;
  std::vector<std::unique_ptr<WindowCloud>> clouds;
  for (bool more = true; std::exchange(more, false);) {
    while (const auto next = channels_.windows.pop()) clouds.emplace_back(*next);
    while (const auto next = channels_.scans.pop()) scans.emplace_back(*next), more = true;
  }
  // Without news the vehicle may have come to the edge of its world all the same.
  if (scans.empty() && clouds.empty()) return window_ && move_world(false, channels_.map_ns.load().value_or(0));
  map::VoxelBox said, gone;
  std::optional<std::int64_t> newest_ns;
  const auto newer = [&](std::int64_t ns) { newest_ns = std::max(newest_ns.value_or(ns), ns); };
  auto cloud = clouds.begin();
  const auto clouds_before = [&](std::int64_t ns) {
    for (; cloud != clouds.end() && (*cloud)->received_ns < ns; ++cloud) {
      take_cloud(**cloud, said, gone);
      if (!(*cloud)->free) newer((*cloud)->received_ns);
    }
  };
  for (const auto& scan : scans) {
    clouds_before(scan->received_ns);
    if (take_scan(*scan, said)) newer(scan->received_ns);
  }
  clouds_before(INT64_MAX);
  const std::int64_t seen_ns = newest_ns.value_or(channels_.map_ns.load().value_or(0));
  auto world = world_;
  for (const auto* box : {&said, &gone})
    if (!box->empty()) world = plan::update_world(*world, live_->grid(), *box, model_, parallel_);
  if (world != world_) {
    publish(std::move(world), seen_ns);
    spdlog::debug("map updated in {} ms", (now_ns() - begun) / 1'000'000);
  } else if (newest_ns && world_) {
    channels_.map_ns.store(*newest_ns);  // the snapshot says what they say
  }
  if (window_) move_world(false, seen_ns);
  return true;
}

}  // namespace backwash::daemon

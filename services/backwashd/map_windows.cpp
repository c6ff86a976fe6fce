// SPDX-License-Identifier: BSD-3-Clause
#include <spdlog/spdlog.h>

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

/// A world at another place, where the vehicle has come to the edge of the one in use. False: there is no need, or
/// nothing to make one of.
bool MapWorker::move_world(const map::OccupancyGrid* live, std::int64_t seen_ns) {
  if (const auto newest = channels_.vehicle_W.read_new()) vehicle_W_ = *newest;
  if (!vehicle_W_) return false;
  auto grid = window_->moved(*vehicle_W_, live);
  if (!grid) return false;
  const auto begun = now_ns();
  const Index3 size = grid->size();
  live_.emplace(*grid);
  publish(made(std::move(*grid)), seen_ns);
  spdlog::info("world of the window made around the vehicle: {} x {} x {} voxels in {} ms", size.x(), size.y(),
               size.z(), (now_ns() - begun) / 1'000'000);
  return true;
}

/// Clouds that came meanwhile are taken in together. An age of the map is that of the newest occupied one: free voxels
/// alone say nothing of what has come.
bool MapWorker::take_windows() {
  if (!window_) return false;
  std::optional<std::int64_t> occupied_ns;
  bool any = false;
  while (const auto next = channels_.windows.pop()) {
    const std::unique_ptr<WindowCloud> cloud(*next);
    window_->take(*cloud);
    if (!cloud->free) occupied_ns = cloud->received_ns;
    ++channels_.scans_accepted;
    any = true;
  }
  const std::int64_t seen_ns = occupied_ns.value_or(channels_.map_ns.load().value_or(0));
  const auto changes = window_->changes(live_ ? &*live_ : nullptr);
  tell_let_go(changes);
  auto world = world_;
  for (const auto* change : {&changes.said, &changes.gone}) {
    if (change->box.empty()) continue;
    if (!change->occupied.empty()) channels_.map_voxels.push(as_new_voxels(world->grid, *change, seen_ns));
    world = plan::update_world(*world, live_->grid(), change->box, model_, parallel_);
  }
  if (world != world_)
    publish(std::move(world), seen_ns);
  else if (occupied_ns && world_)
    channels_.map_ns.store(*occupied_ns);  // the snapshot says what the cloud says
  return move_world(live_ ? &live_->grid() : nullptr, seen_ns) || any;
}

}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/window_keeper.hpp"

#include <algorithm>
#include <utility>

namespace backwash::daemon {
namespace {

Index3 low_of(const map::OccupancyGrid& grid) {
  return (grid.origin() / grid.resolution()).array().round().cast<int>();
}

void note(map::ScanChange& change, const Index3& v, map::Cell now) {
  change.box.add(v);
  if (now != map::Cell::free) change.occupied.push_back(v);
}

}  // namespace

WindowKeeper::WindowKeeper(const MapSettings& settings)
    : told_(settings.window), seen_(static_cast<std::size_t>(told_.keep_voxels) / map::SeenWindow::kPartVoxels) {
  const auto cap = static_cast<std::size_t>(settings.max_mib * (1 << 20));
  const std::size_t world = static_cast<std::size_t>(told_.world().cast<double>().prod()) * config::kWorldBytesPerVoxel;
  most_fixed_ = cap / (config::kWorldBytesPerVoxel + 1);
  most_whole_ = std::max(most_fixed_, cap - std::min(cap, world));
}

map::Cell WindowKeeper::of_whole(const Index3& v) const noexcept {
  return whole_ ? whole_->at(Index3(v - low_of(*whole_))) : map::Cell::unknown;
}

map::OccupancyGrid WindowKeeper::composed(const Index3& low, const Index3& size, const map::OccupancyGrid* live) const {
  map::OccupancyGrid grid(low.cast<double>() * told_.resolution, told_.resolution, size);
  const Index3 live_low = live ? low_of(*live) : Index3::Zero();
  map::for_each_voxel(map::all_of(size), [&](const Index3& v) {
    const Index3 at = low + v;
    if (live && live->inside(at - live_low)) return grid.set(v, live->at(Index3(at - live_low)));
    const map::Cell said = seen_.at(at);
    grid.set(v, said != map::Cell::unknown ? said : of_whole(at));
  });
  return grid;
}

std::optional<map::OccupancyGrid> WindowKeeper::whole(map::OccupancyGrid map) {
  seen_.forget_free();
  whole_ = std::move(map);
  fixed_ = whole_->cell_count() <= most_fixed_;
  if (!fixed_) return std::nullopt;
  return composed(low_of(*whole_), whole_->size(), nullptr);
}

std::optional<map::OccupancyGrid> WindowKeeper::moved(const Vec3& vehicle_W, const map::OccupancyGrid* live) const {
  if (fixed_ || !(whole_ || (occupied_came_ && free_came_))) return std::nullopt;
  const Vec3 middle = vehicle_W / told_.resolution;
  if (!(middle.cwiseAbs().maxCoeff() < 1e7)) return std::nullopt;
  const auto low = [&](const Index3& size) -> Index3 {
    return (middle - size.cast<double>() / 2).array().round().cast<int>();
  };
  const Index3 window = told_.voxels(), size = told_.world();
  if (live) {
    const Index3 from = low(window) - low_of(*live);
    if (live->inside(from) && live->inside(from + window - Index3::Ones())) return std::nullopt;
  }
  return composed(low(size), size, live);
}

WindowKeeper::Changes WindowKeeper::take(const WindowCloud& cloud, map::LiveMap* live) {
  Changes result;
  const Index3 low = live ? low_of(live->grid()) : Index3::Zero();
  const auto set = [&](const Index3& at, map::Cell now, map::ScanChange& change) {
    const Index3 v = at - low;
    if (!live || !live->grid().inside(v)) return;
    const bool known = live->grid().at(v) == now;
    live->set(v, now);
    if (!known) note(change, v, now);
  };
  (cloud.free ? free_came_ : occupied_came_) = true;
  if (cloud.free) {
    for (const Index3& at : seen_.freed(cloud.voxels, cloud.stamp_ns)) set(at, map::Cell::free, result.said);
  } else {
    if (cloud.first) seen_.restart();
    seen_.occupied(cloud.voxels, cloud.stamp_ns);
    for (const Index3& at : cloud.voxels) set(at, map::Cell::occupied, result.said);
  }
  for (const auto& [at, said] : seen_.evict(cloud.window)) {
    ++result.let_go;
    result.let_go_blocks += said == map::Cell::occupied;
    const Index3 v = at - low;
    if (live && live->grid().at(v) == said && !live->found(v)) set(at, of_whole(at), result.gone);
  }
  return result;
}

}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/config/daemon_config.hpp"
#include "core/track/flight_tick.hpp"
#include "core/types/vehicle.hpp"
#include "services/backwashd/channels.hpp"

namespace backwash::daemon {

using MapSettings = decltype(config::Daemon::map);

/// What the map says about a tick (faults.md rows 9, 10, 13, 14). The control thread's part of the map: it looks at the
/// newest snapshot and, before any snapshot holds them, at the voxels that a scan has just found occupied.
class Lookout {
 public:
  Lookout(Channels& channels, const Vehicle& vehicle, const MapSettings& map)
      : channels_(channels), map_(map), taken_(vehicle.body.radius + vehicle.estimation.position) {}

  ~Lookout() { channels_.worlds.control.give_back(world_); }
  Lookout(const Lookout&) = delete;
  Lookout& operator=(const Lookout&) = delete;

  /// `flight` as of the last tick. New voxels are held against the sets still to be flown and against the next verified
  /// stop; the newest ones again when a segment was accepted since. Real-time: wait-free, no allocation; 3 to 5 ns per
  /// voxel and set, at most 3 × NewVoxels::kMost voxels.
  track::Surroundings look(const track::FlightTick& flight, std::int64_t now_ns) noexcept;

 private:
  bool late(const track::Tracker& tracker, std::int64_t now_ns) const noexcept;
  void hold_against(const NewVoxels& voxels, const track::Tracker& tracker, track::Surroundings& result) const noexcept;

  Channels& channels_;
  MapSettings map_;
  double taken_;
  const Worlds::Pointer* world_ = nullptr;
  NewVoxels recent_;  // the newest of a scan
  std::uint64_t segment_ = 0;
};

}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "core/config/daemon_config.hpp"
#include "core/track/flight_tick.hpp"
#include "core/types/vehicle.hpp"
#include "services/backwashd/map/mapped.hpp"
#include "services/backwashd/plan/planned.hpp"

namespace backwash::daemon {

using MapSettings = decltype(config::Daemon::map);

/// What the map says about a tick (docs/faults.md rows 9, 10, 13, 14). The control thread's part of the map: it looks
/// at the newest snapshot and, before any snapshot holds them, at the voxels that a scan has just found occupied.
class Lookout {
 public:
  Lookout(Mapped& mapped, const Planned& planned, const Vehicle& vehicle, const MapSettings& map)
      : mapped_(mapped), planned_(planned), map_(map), taken_(vehicle.body.radius + vehicle.estimation.position) {}

  ~Lookout() { mapped_.worlds.control.give_back(world_); }
  Lookout(const Lookout&) = delete;
  Lookout& operator=(const Lookout&) = delete;

  /// `flight` as of the last tick. New voxels are held against the sets still to be flown and against the next verified
  /// stop, kRecordsInTick records of a ring a tick, so that a full ring waits one tick more. What a ring had no room
  /// for is everywhere. Held against them are also, kRecordsInTick a tick, the records that came after the snapshot in
  /// which a segment that was accepted since was verified. Where more came than are kept the segment counts as blocked.
  /// Real-time: wait-free, no allocation; at most 3 × kRecordsInTick × NewVoxels::kMost boxes, each against boxes
  /// around runs of sets, and against the sets of the runs near it.
  track::Surroundings look(const track::FlightTick& flight, std::int64_t now_ns) noexcept;

  /// Σ and class of the air at a place; real-time as look().
  plan::AirPlace air_at(const Vec3& p_W) const noexcept {
    if (!world_) return {};
    return plan::air_at(world_->world->air, world_->world->grid, p_W);
  }

 private:
  class Runs;
  struct Ahead;
  bool late(const track::FlightTick& flight, std::int64_t now_ns) const noexcept;
  bool catch_up(std::size_t end, std::int64_t seen_ns, const Ahead& ahead, track::Surroundings& result) noexcept;
  void take_new(std::int64_t now_ns) noexcept;
  void hold_against(const NewVoxels& voxels, const Ahead& ahead, track::Surroundings& result) const noexcept;

  Mapped& mapped_;
  const Planned& planned_;
  MapSettings map_;
  double taken_;  // by the body
  const Snapshot* world_ = nullptr;
  static constexpr std::size_t kKept = 32;  // 3 s of scans at 10 Hz: a snapshot of a building takes that long
  std::array<NewVoxels, kKept> recent_{};   // record n at n % kKept
  std::size_t recorded_ = 0, unchecked_ = 0;
  std::uint64_t lost_ = 0;  // records that the rings had no room for
  std::uint64_t segment_ = 0;
  std::uint32_t closures_ = 0;
};

}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/plan/world/world.hpp"
#include "core/sync/handover.hpp"
#include "core/sync/latest_value.hpp"
#include "core/sync/record_ring.hpp"
#include "core/types/time.hpp"
#include "services/backwashd/clock.hpp"
#include "services/backwashd/map/map_news.hpp"
#include "services/backwashd/text.hpp"

namespace backwash::daemon {

/// The surroundings as they were seen.
struct Snapshot {
  std::shared_ptr<const plan::World> world;
  std::int64_t seen_ns = 0;  ///< reception of the newest data in it
};

/// The newest snapshot, to each thread that looks at it. Freed by the map worker alone.
struct Worlds {
  sync::Handover<Snapshot> mission, planner, reader, control;

  void offer(const Snapshot& newest) {
    for (auto* to : {&mission, &planner, &reader, &control}) to->offer(std::make_unique<const Snapshot>(newest));
  }
  void collect() {
    for (auto* to : {&mission, &planner, &reader, &control}) to->collect();
  }
};

/// What became of a map that came in parts.
struct MapVerdict {
  std::uint64_t transfer = 0;
  bool accepted = false;
  Line why{};  ///< it was not
};

inline constexpr std::size_t kVoxelRecords = 8;

/// Written by the map reader and the map worker, which both count what they refuse.
struct Mapped {
  sync::LatestValue<Line> refused_map;         // map reader → status: the newest, and why
  sync::Handover<MapMessage> maps;             // map reader → map worker
  sync::LatestValue<MapVerdict> map_verdict;   // map worker → map reader: of the last that came in parts
  sync::LatestValue<MapWriter> map_writer;     // map worker → map reader: of the first good map of a term
  sync::RecordRing<Scan*, 16> scans;           // map reader → map worker, which frees them
  sync::RecordRing<WindowCloud*, 16> windows;  // map reader → map worker, which frees them
  Worlds worlds;                               // map worker → each
  /// Map reader, map worker → control, which takes what finds no room to be everywhere.
  sync::RecordRing<NewVoxels, kVoxelRecords> scan_voxels, map_voxels;
  AtomicTime map_ns;                     // map worker: reception of the newest data in the snapshot
  std::atomic<bool> world_moves{false};  // map worker → planner: the newest world goes along with a mapper's window
  std::atomic<bool> map_partial{false};  // map worker → planner: the newest world is what is around the vehicle alone
  std::atomic<std::uint64_t> maps_accepted{0}, maps_rejected{0}, scans_accepted{0}, scans_rejected{0};

  /// s since the newest data in the map was received; nothing: there is no map. Real-time: wait-free.
  std::optional<double> map_age(std::int64_t now_ns) const noexcept {
    const std::optional<std::int64_t> received_ns = map_ns.load();
    return received_ns ? std::optional(seconds(now_ns - *received_ns)) : std::nullopt;
  }
};

}  // namespace backwash::daemon

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <optional>
#include <vector>

#include "services/backwashd/control/refusals.hpp"
#include "services/backwashd/map/mapped.hpp"
#include "services/backwashd/map/window_clouds.hpp"
#include "services/backwashd/out/bound_writer.hpp"
#include "services/backwashd/record/recorder.hpp"

namespace backwash::daemon {

/// The topics of a mapper's window: each is taken from one writer. Used by the map reader's thread.
class WindowFront {
 public:
  WindowFront(const config::Daemon& config, const dds::Participant& participant, Mapped& mapped, Recorder& recorder);
  void add_to(dds::WaitSet& waitset) const;
  void add_to(std::vector<const dds::detail::ReaderBase*>& readers) const;
  /// Occupied voxels that are free in `known`, the newest snapshot's grid or null, go straight to the control thread,
  /// each good cloud to the map worker.
  void take(const map::OccupancyGrid* known, const std::optional<Vec3>& vehicle_W, Refusals& refusals);

 private:
  struct Kind {
    bool free;
    dds::Reader<dds::PointCloud> reader;
    BoundWriter writer;
    std::unique_ptr<std::atomic<std::uint64_t>> rejected, beyond, gone;  // said apart from each other
  };
  void take(Kind& kind, const map::OccupancyGrid* known, const std::optional<Vec3>& vehicle_W, Refusals& refusals);

  Mapped& mapped_;
  Recorder& recorder_;
  WindowClouds clouds_;
  std::vector<Kind> kinds_;
};

}  // namespace backwash::daemon

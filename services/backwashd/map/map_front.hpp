// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <optional>
#include <string>

#include "core/config/daemon_config.hpp"
#include "core/track/tracker.hpp"
#include "services/backwashd/control/refusals.hpp"
#include "services/backwashd/in/partial_watch.hpp"
#include "services/backwashd/in/silent_writers.hpp"
#include "services/backwashd/map/map_parts.hpp"
#include "services/backwashd/map/mapped.hpp"
#include "services/backwashd/map/scan_placement.hpp"
#include "services/backwashd/map/window_front.hpp"
#include "services/backwashd/out/bound_writer.hpp"
#include "services/backwashd/out/shown_field.hpp"
#include "services/backwashd/out/shown_writer.hpp"
#include "services/backwashd/record/recorder.hpp"
#include "services/dds/topics.hpp"
#include "services/dds/writers.hpp"

namespace backwash::daemon {

struct Channels;

/// The daemon's side of the DDS topics that carry large samples: maps and scans in, tube, trajectory, markers and the
/// disturbance out. Its participant has sockets and threads of its own, of ordinary scheduling: whatever is sent here,
/// odometry and commands (DdsFront) do not wait for it (docs/faults.md row 46).
///
/// Maps are taken from one writer, and scans from one: the first whose sample was good, until it is gone (row 48). Its
/// successor is listened to in flight too: without it what appears in the way would stay unseen.
class MapFront {
 public:
  static constexpr std::size_t kMaxMapBytes = 48u << 20;  ///< larger maps are refused before they are copied

  /// `body_radius`: as of ScanPlacement.
  MapFront(const config::Daemon& config, double body_radius, Channels& channels, Recorder& recorder);
  ~MapFront();
  MapFront(const MapFront&) = delete;
  MapFront& operator=(const MapFront&) = delete;

  /// Thread body: new voxels of a scan go straight to the control thread, the scan to the map worker.
  void run_readers();
  /// Called by the planner thread: tube, trajectory and markers out.
  void send(const track::AcceptedSegment& segment);

 private:
  void take_poses();
  void offer(MapMessage message);
  void take_maps();
  void take_parts();
  void tell_lost(const std::optional<std::string>& line);
  void take_scans();
  void let_writers_go();
  void watch_what_does_not_come();
  void show_disturbance();

  Channels& channels_;
  Recorder& recorder_;
  std::string map_frame_;  // that everything on these topics is in
  double sensor_range_;
  ScanPlacement placement_;
  Refusals refusals_;
  MapParts assembly_;
  PartialWatch partial_;
  std::optional<SilentWriters> silent_;  // where fragments may be encrypted
  std::atomic<std::uint64_t> maps_lost_{0}, late_{0};
  BoundWriter map_writer_{"a map"}, scan_writer_{"a scan"};
  std::uint32_t term_ = 0;           // rises when a map's writer is let go of
  const Snapshot* world_ = nullptr;  // the reader's
  FieldShows shows_;
  dds::Participant participant_;
  dds::Reader<dds::Octomap> maps_;
  dds::Reader<dds::PointCloud> scans_;
  dds::Reader<dds::MapPart> parts_;
  std::optional<WindowFront> window_;  // where a mapper's is declared
  dds::ForeignWriters foreign_;
  ShownWriter<dds::MapReceipt> receipts_;
  ShownWriter<dds::Tube> tube_;
  ShownWriter<dds::Path> trajectory_;
  ShownWriter<dds::MarkerArray> markers_;
  ShownWriter<dds::Disturbance> disturbance_;
  dds::WaitSet waitset_;
};

}  // namespace backwash::daemon

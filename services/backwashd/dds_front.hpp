// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>

#include "core/config/daemon_config.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/localization.hpp"
#include "services/backwashd/mission.hpp"
#include "services/backwashd/recorder.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// The daemon's side of the DDS topics (interfaces.md).
class DdsFront {
 public:
  /// `priority`: SCHED_FIFO priority of the threads between the network and the control thread; 0: ordinary.
  DdsFront(const config::Daemon& config, int priority, const Vehicle& vehicle, Channels& channels, Recorder& recorder);
  ~DdsFront() { channels_.worlds.reader.give_back(world_); }
  DdsFront(const DdsFront&) = delete;
  DdsFront& operator=(const DdsFront&) = delete;

  /// Thread body: odometry, loop closures, scans, maps and commands in. New voxels of a scan go straight to the control
  /// thread, the scan to the map worker. What is refused is counted, and said at most once a second of each topic.
  void run_readers();
  /// Thread body: status out at 10 Hz.
  void run_status(const Vehicle& vehicle);
  /// Called by the mission thread.
  void send(const CommandMessage& command, const Answer& answer);
  /// Called by the planner thread: tube and trajectory out.
  void send(const track::AcceptedSegment& segment);

 private:
  void take_odometry();
  void take_maps();
  void take_scans();
  void take_closures();
  void take_commands();
  void refuse(std::atomic<std::uint64_t>& counter, const std::string& why);

  Channels& channels_;
  Recorder& recorder_;
  int priority_;
  double sensor_range_;
  Localization localization_;
  const Snapshot* world_ = nullptr;              // the reader's
  std::map<const void*, std::int64_t> said_ns_;  // when each cause was last told, by its counter
  dds::Malformed malformed_;                     // before the middleware's threads
  dds::Participant participant_;
  dds::Reader<dds::Odometry> odometry_;
  dds::Reader<dds::Octomap> maps_;
  dds::Reader<dds::PointCloud> scans_;
  dds::Reader<dds::TransformStamped> closures_;
  dds::Reader<dds::Command> commands_;
  dds::ForeignWriters foreign_;
  dds::Writer<dds::Ack> acks_;
  dds::Writer<dds::Status> status_;
  dds::Writer<dds::Tube> tube_;
  dds::Writer<dds::Path> trajectory_;
  dds::WaitSet waitset_;
};

}  // namespace backwash::daemon

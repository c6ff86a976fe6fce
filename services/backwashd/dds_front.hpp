// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/config/daemon_config.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/mission.hpp"
#include "services/backwashd/recorder.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// The daemon's side of the DDS topics (interfaces.md).
class DdsFront {
 public:
  /// `priority`: SCHED_FIFO priority of the threads between the network and the control thread; 0: ordinary.
  DdsFront(const config::Daemon& config, int priority, Channels& channels, Recorder& recorder);

  /// Thread body: odometry, maps and commands in.
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
  void take_commands();

  Channels& channels_;
  Recorder& recorder_;
  int priority_;
  dds::Participant participant_;
  dds::Reader<dds::Odometry> odometry_;
  dds::Reader<dds::Octomap> maps_;
  dds::Reader<dds::Command> commands_;
  dds::Writer<dds::Ack> acks_;
  dds::Writer<dds::Status> status_;
  dds::Writer<dds::Tube> tube_;
  dds::Writer<dds::Path> trajectory_;
  dds::WaitSet waitset_;
};

}  // namespace backwash::daemon

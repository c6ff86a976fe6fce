// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "core/config/daemon_config.hpp"
#include "services/backwashd/clock.hpp"
#include "services/backwashd/control/refusals.hpp"
#include "services/backwashd/in/allowance.hpp"
#include "services/backwashd/in/drift_notice.hpp"
#include "services/backwashd/in/localization.hpp"
#include "services/backwashd/in/odometry_check.hpp"
#include "services/backwashd/in/other_daemons.hpp"
#include "services/backwashd/in/pose_source.hpp"
#include "services/backwashd/in/received.hpp"
#include "services/backwashd/out/bound_writer.hpp"
#include "services/backwashd/out/shown_battery.hpp"
#include "services/backwashd/out/shown_transforms.hpp"
#include "services/backwashd/out/shown_writer.hpp"
#include "services/backwashd/plan/mission.hpp"
#include "services/backwashd/record/recorder.hpp"
#include "services/dds/topics.hpp"
#include "services/dds/writers.hpp"

namespace backwash::daemon {

struct Channels;

/// The daemon's side of the DDS topics that flight depends on: odometry, loop closures and commands in, answers and
/// status out (docs/interfaces.md); those with large samples are MapFront's. It has no Recorder, whose lock a thread of
/// ordinary priority may hold: what is received goes to the raw log through Channels::command_log.
class DdsFront {
 public:
  /// `priority`: SCHED_FIFO priority of the threads between the network and the control thread; 0: ordinary.
  DdsFront(const config::Daemon& config, int priority, const Vehicle& vehicle, Channels& channels);

  /// Thread body. Odometry is taken from one writer, and loop closures from one: the first whose sample was good, until
  /// it is gone and nothing is commanded any more; those of others are refused by identity (docs/faults.md row 48).
  void run_readers();
  /// Thread body: status and transforms out at 10 Hz, diagnostics and battery at 1 Hz.
  void run_status(const Vehicle& vehicle, const Recorder& recorder);
  /// Called by the mission thread.
  void send(const CommandMessage& command, const Answer& answer);

 private:
  void take_poses();
  void take_odometry(const dds::Odometry& message, const dds::Guid& writer);
  void look_at_odometry(const dds::Odometry& message);
  void take_closures();
  void tell_closures();
  void take_closure(const dds::TransformStamped& message, const dds::Guid& writer);
  void let_closures_go(std::span<const dds::Guid> departed);
  void take_commands();
  void take_command(const dds::Command& message, const dds::Guid& writer);
  void tell_of_departed();
  void look_for_other_daemons();

  Channels& channels_;
  int priority_;
  std::string name_space_;
  Localization localization_;
  OdometryCheck check_;
  DriftNotice drift_;
  Refusals refusals_;
  std::atomic<std::uint64_t> poses_lost_{0};
  BoundWriter odometry_writer_{"odometry"}, closure_writer_{"a loop closure"};
  OtherDaemons others_{now_ns()};
  std::atomic<bool> commanding_{false};                       // status → reader
  std::map<dds::Guid, std::array<Allowance, 2>> allowances_;  // of writers of commands: for STOP, for the others
  std::optional<CommandMessage> stop_;                        // the newest STOP that the mission had no room for
  std::vector<dds::Guid> gone_;  // writers of commands, of which the mission has not been told yet
  dds::Malformed malformed_;     // before the middleware's threads
  dds::Participant participant_;
  PoseSource poses_;
  dds::Reader<dds::TransformStamped> closures_;
  dds::Reader<dds::Command> commands_;
  dds::ForeignWriters foreign_;
  dds::Writer<dds::Ack> acks_;
  dds::Writer<dds::Status> status_;
  ShownWriter<dds::DiagnosticArray> diagnostics_;
  ShownWriter<dds::BatteryState> battery_;
  ShownBattery shown_battery_;
  ShownTransforms transforms_;
  std::optional<ShownWriter<dds::TfMessage>> tf_;  // where dds.tf asks for it
  dds::OtherWriters statuses_;
  dds::WaitSet waitset_;
};

}  // namespace backwash::daemon

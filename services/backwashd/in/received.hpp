// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "core/sync/latest_value.hpp"
#include "core/sync/record_ring.hpp"
#include "core/track/odometry_gate.hpp"
#include "core/types/geometry.hpp"
#include "services/backwashd/map/map_news.hpp"
#include "services/backwashd/record/control_record.hpp"
#include "services/backwashd/text.hpp"

namespace backwash::daemon {

using track::OdometrySample;

/// One command as received, or the news that a writer of commands is gone. Of the station's name only printable
/// characters are left, and as many as fit.
struct CommandMessage {
  WriterId writer{};      ///< another one at each start of a process
  bool departed = false;  ///< no command: this writer is gone, and with it its session; nothing else here is set
  std::array<char, 64> station{};
  std::uint64_t session = 0;
  std::uint32_t sequence = 0;
  std::uint8_t verb = 0;
  Vec3 position = Vec3::Zero();
  double yaw = 0;
  static constexpr std::size_t kMostWaypoints = 64;
  std::size_t waypoints = 0;  ///< of follow; more than kMostWaypoints: as many were sent, and none is kept
  std::array<std::array<double, 3>, kMostWaypoints> waypoint{};
};

/// Which command of which session.
struct CommandId {
  std::uint64_t session = 0;
  std::uint32_t sequence = 0;
};

/// Written by the DDS reader, which also counts what it refuses.
struct Received {
  sync::LatestValue<OdometrySample> odometry;          // → control
  sync::RecordRing<OdometrySample, 512> poses;         // → map reader
  sync::LatestValue<track::RigidShift> map_from_odom;  // → map reader: the newest loop closure
  sync::LatestValue<Line> refused;                     // → status: the newest, and why
  sync::RecordRing<CommandMessage, 64> commands;       // → mission
  sync::RecordRing<ControlRecord, 256> command_log;    // → recorder
  sync::LatestValue<Line> odometry_doubt;              // → mission: "", or why it is not what we were told
  sync::LatestValue<Line> other_daemon;                // → mission: "", or who else obeys our commands
  std::atomic<std::uint64_t> odometry_refused{0}, loop_closures{0}, closures_refused{0};
  std::atomic<std::uint64_t> foreign_writers{0}, commands_refused{0};  // with map reader; with mission
};

}  // namespace backwash::daemon

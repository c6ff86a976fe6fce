// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <ostream>
#include <span>
#include <string>
#include <string_view>

#include "core/log/autopilot_flight.hpp"
#include "core/log/raw_log.hpp"

namespace backwash::log {

/// The channel that holds the raw records themselves, byte for byte.
inline constexpr std::string_view kRawTopic = "/backwash/raw_log";

/// The channel of the autopilot's own poses, where there are any.
inline constexpr std::string_view kAutopilotTopic = "/autopilot/odometry";

/// Writes a raw log as an MCAP file of ROS 2 messages: what the VIO said, what was commanded, each accepted trajectory
/// with its tube, mode and reason, the error against its bound, commands and answers, the maps, and every raw record.
/// Times are wall time; without a part record (logs of before) those of the daemon's monotonic clock. A message's log
/// time never falls: it is the latest of the records so far. `library`: who writes it. Gives the messages by topic.
/// `autopilot`: what its own log says, rising in time; those within the time of the raw log are written in the frame
/// `autopilot`, and once a second of set-points where that frame lies in the map. Whether the stream took everything is
/// the stream's to tell.
std::map<std::string, std::uint64_t> export_mcap(std::ostream& out, const RawLog& log, std::string_view library,
                                                 std::span<const AutopilotPose> autopilot = {});

}  // namespace backwash::log

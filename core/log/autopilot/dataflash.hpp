// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/log/mcap/topic_log.hpp"

namespace backwash::log {

/// Decodes ArduPilot's DataFlash format (ardupilot.org, "Downloading and Analyzing Data Logs"): messages 0xA3 0x95
/// TYPE, whose formats the log itself holds (FMT). Topics are called as there (`XKF1`, `ATT`), units are those of the
/// file with the hundredths of c, C, e, E taken out. Messages without `TimeUS` and text fields are passed over, but for
/// PARM and MSG. A message is read if another one begins where it ends, and its time is one of its neighbours'. What
/// lies between two such is skipped, and counted as loss. Error: one line, where no format is found at all.
tl::expected<TopicLog, std::string> decode_dataflash(std::span<const std::uint8_t> bytes);

/// The same flight under PX4's names: XKF1 or NKF1 of the core that was in use, what XKF4 or NKF4 calls valid, ATT,
/// IMU, PSCN, PSCE, PSCD, BAT, RCOU, CTUN.
TopicLog px4_names(const TopicLog& dataflash);

/// Reads an ArduPilot log as a flight log. Errors: not_found; bad_data with what is missing.
tl::expected<FlightLog, LogError> read_dataflash(const std::string& path);

}  // namespace backwash::log

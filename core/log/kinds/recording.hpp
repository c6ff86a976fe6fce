// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/log/columns/flight_log.hpp"
#include "core/log/mcap/topic_log.hpp"

namespace backwash::log {

/// A kind of recording. Which one a file is its content says, not its name, and not whether gzip or zip packed it.
struct RecordingKind {
  enum class Form { autopilot, raw_log, table, other };
  std::string_view name;  ///< as `backwash import` takes it; empty: it takes none of this kind
  Form form = Form::other;
  std::string_view words;                                                        ///< "a ULog of PX4"
  tl::expected<FlightLog, LogError> (*read)(const std::string& path) = nullptr;  ///< none: not read here
  std::string_view way = {};  ///< then: the command that makes FILE readable, or what to do
};

/// Every kind that `backwash import` takes by name.
std::span<const RecordingKind> importable_recordings() noexcept;

/// Which kind a file is. Errors: not_found; bad_data where it is none that is known, or is packed and damaged.
tl::expected<const RecordingKind*, LogError> recording_of(const std::string& path);

/// Reads a file of any kind that is read. Errors: recording_of()'s, the reader's; bad_data with the way of a kind that
/// is not.
tl::expected<FlightLog, LogError> read_recording(const std::string& path);

/// The topics of an autopilot's log under PX4's names. Errors: as read_recording(); bad_data for another kind.
tl::expected<TopicLog, LogError> read_autopilots_log(const std::string& path);

/// Why a file of a kind is not read, and what makes it readable.
LogError not_read(const std::string& path, const RecordingKind& kind);

}  // namespace backwash::log

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/log/mcap/topic_log.hpp"

namespace backwash::log {

/// Decodes the ULog format (docs.px4.io, ULog File Format): header, flag bits with appended data, formats,
/// subscriptions, data, parameters, dropouts; other messages are passed over. Nested types and arrays become
/// `name.field` and `name[3]`; padding is dropped. The format has no checksums: a message is read if it fits its
/// format, another one begins where it ends, and its time is one of its neighbours'. What lies between two such is
/// skipped, and counted as loss. Error: one line, for a wrong magic, unknown incompatible flags, or no message that
/// fits.
tl::expected<TopicLog, std::string> decode_ulog(std::span<const std::uint8_t> bytes);

/// Reads a PX4 log as a flight log. Errors: not_found; bad_data with the offset, or the topic that is missing.
tl::expected<FlightLog, LogError> read_ulog(const std::string& path);

}  // namespace backwash::log

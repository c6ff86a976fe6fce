// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/log/mcap/topic_log.hpp"

namespace backwash::log {

/// Decodes the ULog format (docs.px4.io, ULog File Format): header, flag bits with appended data, formats,
/// subscriptions, data, dropouts; other messages are passed over. Nested types and arrays become `name.field` and
/// `name[3]`; padding is dropped. A last message cut short is dropped (a log ends without warning). Error: one line
/// with the byte offset, for a wrong magic, unknown incompatible flags, a format that cannot be, data without a
/// subscription or of a wrong size.
tl::expected<TopicLog, std::string> decode_ulog(std::span<const std::uint8_t> bytes);

/// Reads a PX4 log as a flight log. Errors: not_found; bad_data with the offset, or the topic that is missing.
tl::expected<FlightLog, LogError> read_ulog(const std::string& path);

}  // namespace backwash::log

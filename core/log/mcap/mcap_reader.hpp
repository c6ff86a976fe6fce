// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "core/log/raw/raw_log.hpp"

namespace backwash::log {

/// Whether these are the first bytes of an MCAP file.
bool is_mcap(std::span<const std::uint8_t> bytes) noexcept;

/// The raw log in an MCAP file of backwashd or `backwash export`: what kRawTopic holds, in the file's order. A file
/// that is cut short gives its whole records. Errors: bad_data with the byte offset: a checksum that does not fit, a
/// chunk that somebody compressed, no such channel, a message of it that is no record.
tl::expected<RawLog, LogError> raw_log_of_mcap(const std::string& path, std::span<const std::uint8_t> bytes);

}  // namespace backwash::log

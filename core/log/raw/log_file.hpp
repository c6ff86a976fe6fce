// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/files/read_file.hpp"
#include "core/log/columns/flight_log.hpp"

namespace backwash::log {

/// The whole of a recorded file (files::read_file), its error as LogError: bad_data if it is too large, else not_found.
tl::expected<std::string, LogError> read_log_file(const std::string& path, std::size_t most_bytes,
                                                  const std::string& wanted);

}  // namespace backwash::log

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "core/log/raw/raw_log.hpp"
#include "core/map/occupancy_grid.hpp"

namespace backwash::report {

/// The map that the daemon flew with: the last one it accepted. Error: bad_data if there is none or it cannot be read.
tl::expected<map::OccupancyGrid, log::LogError> recorded_map(std::span<const log::RawRecord> log);
/// Whether this record holds a map that the daemon accepted.
bool accepted_map(const log::RawRecord& record) noexcept;
/// The map of such a record. Errors: bad_data.
tl::expected<map::OccupancyGrid, log::LogError> recorded_map(const log::RawRecord& accepted);

}  // namespace backwash::report

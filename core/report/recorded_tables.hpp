// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/log/raw/raw_log.hpp"
#include "core/report/page/page_data.hpp"

namespace backwash::report {

/// Of each tick with a judged position: error and bound on each axis as they were logged. Times are since `zero_ns`,
/// here and below.
DataTable recorded_error(std::span<const log::RawRecord> log, std::int64_t zero_ns);
/// Error on each axis between its bounds, of a table `error` with error_x_m, bound_x_m and so on; `ellipsoids`: it has
/// ellipsoid_x_m too.
std::vector<TimePlot> error_plots(bool ellipsoids);
/// The sets predicted for the ticks of a log.
std::vector<Prism> recorded_tube(std::span<const log::RawRecord> log);

/// What a log says of the air, where the flight learnt of it, and of the machine: tick timing, link and odometry rates,
/// battery. Each with its table in `data`; what the log has nothing of is said.
std::vector<Section> recorded_sections(std::span<const log::RawRecord> log, std::int64_t zero_ns, PageData& data);

/// Of each tick that learnt of its air: place, class, and of each class that was flown in so far its factor and its
/// evidence. Of the two that may raise a factor the larger one counts, each over what it takes: 1 is "rougher".
DataTable recorded_air(std::span<const log::RawRecord> log, std::int64_t zero_ns);

/// The files that the daemon was configured with, as the log holds them.
std::string recorded_configuration(std::span<const log::RawRecord> log);

}  // namespace backwash::report

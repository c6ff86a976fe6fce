// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/log/raw_log.hpp"
#include "core/report/flight_report.hpp"
#include "services/backwash/flight_story.hpp"

namespace backwash::services {

/// The line that started this process, as a shell takes it again; the program by its name alone.
std::string own_command();
/// The text of vehicle and model, of files or built in; those that can be read.
std::vector<std::pair<std::string, std::string>> parameter_files(const std::string& vehicle, const std::string& model);
/// Timeline, the machine's sections and their data. `zero_ns`: time 0 of the page.
report::RecordedBeside recorded_beside(std::span<const log::RawRecord> log, const FlightStory& story,
                                       std::int64_t zero_ns);

}  // namespace backwash::services

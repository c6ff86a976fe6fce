// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "core/study/design/design.hpp"
#include "services/backwash/json.hpp"
#include "services/command_line/command_line.hpp"

namespace backwash::services {

/// `--design`, `--start`, `--flight-time` of `backwash study`.
struct DesignOptions {
  std::string points;                                           ///< points file to write; empty: no design is asked for
  std::optional<Vec3> start;                                    ///< m, W
  double flight_time = study::kDesignRules.design_flight_time;  ///< s
};
void add_design(Command& command, DesignOptions& options);
/// Throws Failure: a usage error without map or start, 73 for a points file that exists.
void check_design(const DesignOptions& options, bool mapless, bool force);

/// The next flight, and its points file where one separates; nothing where none was asked for. Throws Failure (69)
/// where hovering at the start is not safe. `grid`: not null where one is asked for.
std::optional<study::Design> designed(const DesignOptions& options, const study::Observations& seen,
                                      const study::StudyResult& result, const Model& model, const Vehicle& vehicle,
                                      const map::OccupancyGrid* grid, bool force);
Json to_json(const study::Design& design, const DesignOptions& options);
void print_text(const study::Design& design, const DesignOptions& options);
/// The same as a section of the page.
std::string html(const study::Design& design, const DesignOptions& options);

}  // namespace backwash::services

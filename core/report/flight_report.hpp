// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/plan/world/world.hpp"
#include "core/report/page/page_data.hpp"
#include "core/sim/flight.hpp"

namespace backwash::report {

/// What a report says beside the flight itself.
struct ReportContext {
  std::string map, model, vehicle;  ///< as given on the command line
  std::string version;
  Vec3 start_W, goal_W;  ///< m
  std::uint64_t seed;
  double sigma_scale;
  std::string command;  ///< the line that wrote the page
  std::vector<std::pair<std::string, std::string>>
      parameters;  ///< files that the flight was flown with: names, contents
};

/// The field at the mean height of a path that holds a point; its table is the page's own (PageData::field).
Section field_section(std::span<const Vec3> path_W, const plan::World& world);

/// The command and the parameters, each to be unfolded.
std::string parameters_html(const std::string& command,
                            const std::vector<std::pair<std::string, std::string>>& parameters);

/// One self-contained HTML page about a flight: verdict, figures, a table of what was measured. Nothing in it refers to
/// another file or host.
std::string flight_report(const sim::Flight& flight, const sim::FlightSummary& summary, const plan::World& world,
                          const ReportContext& context);

}  // namespace backwash::report

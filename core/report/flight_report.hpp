// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "core/report/figures.hpp"

namespace backwash::report {

/// What a report says beside the flight itself.
struct ReportContext {
  std::string map, model, vehicle;  ///< as given on the command line
  std::string version;
  Vec3 start_W, goal_W;               ///< m
  std::optional<std::uint64_t> seed;  ///< of a simulated flight; a recorded one has none
  double sigma_scale;
};

/// One self-contained HTML page about a flight: verdict, figures, a table of what was measured. Nothing in it refers to
/// another file or host. Error: a figure that could not be drawn.
tl::expected<std::string, PlotError> flight_report(const sim::Flight& flight, const sim::FlightSummary& summary,
                                                   const plan::World& world, const ReportContext& context);

}  // namespace backwash::report

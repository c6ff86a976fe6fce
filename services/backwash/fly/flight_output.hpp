// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/report/flight_report.hpp"
#include "core/sim/flight.hpp"

namespace backwash::services {

/// A judged flight and where it came from: what `fly` says about it.
struct JudgedFlight {
  const sim::Flight& flight;
  const plan::World& world;
  const report::ReportContext& context;
  sim::FlightSummary summary;
};

/// Prints the summary (one JSON object or text), after writing the HTML page to `report` unless that is empty. Returns
/// kOk; throws Failure with what went wrong, as one line, when the flight was not good.
int conclude(const JudgedFlight& judged, const std::string& report, bool json, bool force);

}  // namespace backwash::services

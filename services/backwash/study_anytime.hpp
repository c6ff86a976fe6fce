// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/study/inference/anytime.hpp"
#include "services/backwash/json.hpp"

namespace backwash::services {

/// What `backwash study --anytime` says of flights in the order in which they were flown (docs/interfaces.md).
struct AnytimeReport {
  std::vector<std::string> flights;
  std::vector<double> log_e;                            ///< after each
  std::vector<std::pair<std::string, double>> leading;  ///< cause, share of the e-value; largest first
  std::vector<std::string> fleet;                       ///< other vehicles' reports
  double fleet_log_e = 0;                               ///< of all vehicles together, this one with them
  /// Flight from which on the e-value is at least 1/level, from 0; none: never.
  std::optional<std::size_t> since(double level) const;
};

/// `flights`: names, one for each look. `fleet`: files with the JSON of other vehicles' `study --anytime --json`;
/// throws Failure where one is none.
AnytimeReport anytime_report(const std::vector<std::string>& flights, const study::Anytime& anytime,
                             const std::vector<std::string>& fleet);
Json to_json(const AnytimeReport& report);
void print_text(const AnytimeReport& report);
/// Section of the page: what it means, and a row a flight.
std::string html(const AnytimeReport& report);

}  // namespace backwash::services

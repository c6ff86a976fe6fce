// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "services/backwash/learn/calibrate_input.hpp"
#include "services/backwash/learn/study_flights.hpp"

namespace backwash::services {

/// What is compared: flights with their logs kept, which of them were flown after the change, and where to.
struct BeforeAfter {
  std::vector<CampaignFiles::Log> after;
  std::string page;     ///< HTML file to write; empty: none
  std::string context;  ///< of the page: map, model, vehicle
  bool json, force;
};

/// `backwash study --before … --after …` (docs/interfaces.md): text or JSON on stdout, and the page. Throws Failure 65
/// where one flight is on both sides.
int study_before_after(const BeforeAfter& asked, Flights flights, const LookedWith& with);

}  // namespace backwash::services

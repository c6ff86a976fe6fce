// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/report/page/page_data.hpp"

namespace backwash::report {

struct TimelineEvent {
  double t_s;
  const char* kind;  ///< command, mode, flight, map, vio, fault, air
  std::string text;
};

/// Modes with their reasons, and what happened, in one row of time.
struct Timeline {
  std::vector<ModeSpan> modes;  ///< without gaps, in their order
  std::vector<TimelineEvent> events;
};

/// The section: lanes to look at, and the same as a table.
std::string timeline_html(const Timeline& timeline);

}  // namespace backwash::report

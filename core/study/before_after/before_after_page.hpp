// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/study/before_after/before_after.hpp"

namespace backwash::study {

/// "Better: tracking error, 0.7 times. Nothing is worse. Of 9 others these flights cannot tell."
std::string headline(const std::vector<MeasuredChange>& changes);
/// "The groups were flown otherwise: speed, 0.5 times [0.4, 0.6]. That may be all that is told."; empty where they are
/// alike, or where it cannot be told.
std::string flown_otherwise(std::vector<MeasuredChange> flown);
/// "0.71 times [0.6, 0.84]" or "-0.01 s [-0.02, 0]"; what is missing where there is none.
std::string change_words(const MeasuredChange& change);
/// "30 % shows with these; 10 % with 14 flights a side"; empty where nothing was measured on both sides.
std::string power_words(const MeasuredChange& change);

/// One self-contained HTML page: headline, picture of the ratios with their intervals, and all in a table. `context`:
/// what was compared; `first`: HTML that stands behind the headline.
std::string before_after_page(const std::vector<MeasuredChange>& changes, const std::vector<MeasuredChange>& flown,
                              const FlightMeasures& measures, const std::string& context, const std::string& first);

}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "core/report/page/page_data.hpp"
#include "core/study/calibrate/height_effect.hpp"
#include "core/study/findings/consequence.hpp"
#include "core/study/findings/study.hpp"
#include "core/study/inference/rotors/rotor_reference.hpp"

namespace backwash::study {

/// What the page says beside the result.
struct PageContext {
  std::string map, model, vehicle;  ///< as given on the command line
  std::string version;
  std::optional<Consequence> consequence;  ///< of the accepted causes
  std::optional<RotorVerdict> rotors;      ///< against flights known to be sound
  std::optional<calibrate::HeightEffects> height;
  std::string residuals = {};          ///< residual_section(), or empty
  report::PageData data = {};          ///< of that section
  Vehicle read_vehicle = {};           ///< the file as read: what to change is told with its values
  std::vector<std::string> logs = {};  ///< names of the observed flights, in their order
  std::string first = {};              ///< HTML that stands behind the advice: what was left out, and where flights lie
};

/// One self-contained HTML page, read in two minutes: what to do (advice()), what that costs and what flying the
/// extended model costs instead, residual against the named variable before and after, gain, rivals and the flight to
/// fly next, what was not tested, smallest effects that would have been found.
std::string study_page(const StudyResult& result, const Observations& seen, const PageContext& context);

}  // namespace backwash::study

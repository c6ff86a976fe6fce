// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/calibrate/calibration_rules.hpp"

namespace backwash::study::calibrate {

std::vector<Rule> rules() {
  std::vector<Rule> told;
  append_rules(told, kCalibrationRules);
  return told;
}

}  // namespace backwash::study::calibrate

// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/design/design_rules.hpp"

namespace backwash::study {

std::vector<Rule> design_rules() {
  std::vector<Rule> told;
  append_rules(told, kDesignRules);
  return told;
}

}  // namespace backwash::study

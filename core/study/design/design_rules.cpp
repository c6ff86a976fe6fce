// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/design/design_rules.hpp"

#include <bit>

namespace backwash::study {

std::vector<Rule> design_rules() {
  const auto all = std::bit_cast<std::array<Rule, sizeof(DesignRules) / sizeof(Rule)>>(kDesignRules);
  return {all.begin(), all.end()};
}

}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/rules.hpp"

#include <array>
#include <bit>

namespace backwash::study {

std::vector<Rule> rules() {
  static_assert(sizeof(Rules) % sizeof(Rule) == 0, "a member that is no rule");
  const auto all = std::bit_cast<std::array<Rule, sizeof(Rules) / sizeof(Rule)>>(kRules);
  return {all.begin(), all.end()};
}

}  // namespace backwash::study

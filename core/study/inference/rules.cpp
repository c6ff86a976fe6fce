// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/rules.hpp"

#include <array>
#include <bit>

#include "core/study/inference/rotor_rules.hpp"
#include "core/study/windows/window_rules.hpp"

namespace backwash::study {
namespace {

template <typename Struct>
void append(std::vector<Rule>& told, const Struct& rules) {
  static_assert(sizeof(Struct) % sizeof(Rule) == 0, "a member that is no rule");
  const auto all = std::bit_cast<std::array<Rule, sizeof(Struct) / sizeof(Rule)>>(rules);
  told.insert(told.end(), all.begin(), all.end());
}

}  // namespace

std::vector<Rule> rules() {
  std::vector<Rule> told;
  append(told, kRules);
  append(told, kRotorRules);
  append(told, kWindowRules);
  return told;
}

}  // namespace backwash::study

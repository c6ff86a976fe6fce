// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <bit>
#include <string_view>
#include <vector>

namespace backwash::study {

/// A constant of the study with its unit and why it is that: derived, measured (where) or chosen.
struct Rule {
  std::string_view name;
  double value;
  std::string_view unit, reason;
  constexpr operator double() const { return value; }
};

/// Appends every member of a struct of rules, in its order.
template <typename Struct>
void append_rules(std::vector<Rule>& told, const Struct& rules) {
  static_assert(sizeof(Struct) % sizeof(Rule) == 0, "a member that is no rule");
  const auto all = std::bit_cast<std::array<Rule, sizeof(Struct) / sizeof(Rule)>>(rules);
  told.insert(told.end(), all.begin(), all.end());
}

}  // namespace backwash::study

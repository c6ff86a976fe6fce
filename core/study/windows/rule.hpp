// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

namespace backwash::study {

/// A constant of the study with its unit and why it is that: derived, measured (where) or chosen.
struct Rule {
  std::string_view name;
  double value;
  std::string_view unit, reason;
  constexpr operator double() const { return value; }
};

}  // namespace backwash::study

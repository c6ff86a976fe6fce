// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/types/vehicle.hpp"
#include "firmware_bridge/autopilots/profile.hpp"

namespace backwash::firmware_bridge {

/// What the autopilot has said of one rule's parameter.
struct ParameterAnswer {
  std::optional<double> value;  ///< in the unit of the name that it was told by; absent: not yet
  std::uint8_t name = 0;        ///< number of that name
  std::uint8_t lacks = 0;       ///< bit n: it has said that it has no parameter of name n
  std::uint8_t asked = 0;       ///< questions without an answer, one name after the other

  /// Nobody has waited long for it yet: kAskedInVain questions by each name.
  static constexpr std::uint8_t kAskedInVain = 3;
  bool asking(const ParameterRule& rule) const noexcept {
    return !value && lacks != (1u << rule.count()) - 1 && asked < kAskedInVain * rule.count();
  }
};
/// Of each rule of a profile, in their order.
using ParameterValues = std::array<ParameterAnswer, kMostParameters>;

/// What is to be said of one of them.
struct ParameterFinding {
  std::string_view name;  ///< as this autopilot names it; of one that is not known, as its newest version does
  bool required = false;  ///< control is not taken unless it is good
  bool good = false;      ///< false also where the controller has not answered
  bool asking = false;    ///< it has not had the time to answer
  std::optional<double> value;
  std::string advice;  ///< what to set, and why; empty when good
};
/// Of each rule that is asked for. Gains and limits are judged against the vehicle file: a set that was computed for
/// other gains (more than kGainTolerance away in k_p or k_d), or for a motion that the controller cuts off, is no
/// promise. `untold_delay`: of the line (untold_delay(), line_budget.hpp), s; where there is one, the controller must
/// be told.
std::vector<ParameterFinding> judge_parameters(const AutopilotProfile& autopilot, const ParameterValues& values,
                                               const Vehicle& vehicle, double untold_delay = 0);
inline constexpr double kGainTolerance = 0.10;

/// "", or the first required parameter that is not good, its value and what to set. `or_unknown`: one that the
/// controller has not told counts too.
std::string forbidding_parameter(const AutopilotProfile& autopilot, const ParameterValues& values,
                                 const Vehicle& vehicle, double untold_delay = 0, bool or_unknown = true);

/// What the vehicle file asks of a rule's parameter, in our unit: of a position gain what goes with its velocity gain.
double wanted(const ParameterRule& rule, const Vehicle& vehicle, double untold_delay = 0);

}  // namespace backwash::firmware_bridge

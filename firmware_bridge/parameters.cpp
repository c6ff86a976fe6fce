// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/parameters.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/types/angle.hpp"
#include "core/types/formatted.hpp"
#include "core/types/geometry.hpp"

namespace backwash::firmware_bridge {
namespace {

// One rule's parameter as it was told, and what it is judged against.
struct Told {
  const ParameterRule& rule;
  const ParameterAnswer& answer;
  const Vehicle& vehicle;
  double untold_delay;   // s
  double velocity_gain;  // of the same axis, as it was told; of a position gain

  const ParameterName& name() const { return answer.value ? rule.names[answer.name] : rule.names[rule.count() - 1]; }
  double want() const { return name().scale * wanted(rule, vehicle, untold_delay); }
};

bool is_velocity_gain(Ask ask) { return ask == Ask::k_d_horizontal || ask == Ask::k_d_vertical; }

bool near(double value, double want) { return std::abs(value / want - 1) <= kGainTolerance; }

// k_p = P_position · P_velocity as both firmwares cascade them.
bool good(const Told& told) {
  const double value = *told.answer.value, want = told.want();
  // The link carries floats: 0.3 comes as 0.30000001, 1.3 as 1.29999995.
  const auto [said, limit] = std::pair(static_cast<float>(value), static_cast<float>(want));
  const auto& [kp, kd] = std::pair(told.vehicle.controller.kp, told.vehicle.controller.kd);
  const int mask = static_cast<int>(told.rule.bound);
  switch (told.rule.ask) {
    case Ask::time_out:
      return value > 0 && said <= limit;
    case Ask::one_of:
      return value >= 0 && value < 31 && value == std::floor(value) && (mask >> static_cast<int>(value) & 1) != 0;
    case Ask::bits:
      return value >= 0 && value < 1 << 30 && (static_cast<int>(value) & mask) == mask;
    case Ask::k_d_horizontal:
    case Ask::k_d_vertical:
      return near(value, want);
    case Ask::k_p_horizontal:
      return near(value * told.velocity_gain, kp.horizontal);
    case Ask::k_p_vertical:
      return near(value * told.velocity_gain, kp.vertical);
    case Ask::at_least:
    case Ask::v_max:
    case Ask::a_max:
    case Ask::lean:
      return said >= limit;
    case Ask::at_most:
      return said <= limit;
    case Ask::lean_or_zero:
      return said == 0 || said >= limit;
    case Ask::delay:  // an ODOMETRY that waits for no set-point is a fifth faster
      return value >= 0.8 * want && value <= want + told.name().scale * kLatestVio;
    case Ask::k_i_horizontal:
    case Ask::k_i_vertical:
      return true;
  }
  return false;
}

// Control is not taken without it; a time-out that only makes the last motion longer than it should be is told.
bool required(const Told& told) {
  const ParameterRule& rule = told.rule;
  if (rule.need != Need::required) return false;
  if (rule.ask == Ask::delay) return told.untold_delay > 0;
  const auto& value = told.answer.value;
  return !(rule.ask == Ask::time_out && value && *value > 0 &&
           static_cast<float>(*value) <= static_cast<float>(rule.bound));
}

// The vehicle's own gains come first into the vehicle file: they fly already.
std::string gain_advice(const Told& told) {
  const bool velocity = is_velocity_gain(told.rule.ask);
  const bool level = told.rule.ask == Ask::k_d_horizontal || told.rule.ask == Ask::k_p_horizontal;
  return formatted(
      "write %.3g, the gain that flies, into the vehicle file as controller.%s.%s, whose sets are computed for other "
      "gains; or change the tune: set %s to %.3g",
      velocity ? *told.answer.value : *told.answer.value * told.velocity_gain, velocity ? "kd" : "kp",
      level ? "horizontal" : "vertical", std::string(told.name().name).c_str(), told.want());
}

std::string advice(const Told& told) {
  const std::string name(told.name().name);
  const ParameterRule& rule = told.rule;
  switch (rule.ask) {
    case Ask::time_out:
      return formatted("set %s above 0 and to %.3g s at most: for its time%s the vehicle flies on when the daemon dies",
                       name.c_str(), told.want(),
                       rule.late > 0 ? formatted(", and up to %.3g s more,", rule.late).c_str() : "");
    case Ask::v_max:
    case Ask::a_max:
      return formatted("set %s to %.3g or more: the vehicle file's %s is planned with", name.c_str(), told.want(),
                       rule.ask == Ask::v_max ? "v_max" : "a_max");
    case Ask::lean:
    case Ask::lean_or_zero:
      return formatted("set %s to %.0f or more%s: the vehicle file's a_max along both axes leans so far", name.c_str(),
                       std::ceil(told.want()), rule.ask == Ask::lean ? "" : ", or to 0");
    case Ask::delay:
      return formatted("set %s to %.0f ms, and the VIO's own delay: so long are set-point and ODOMETRY on the line",
                       name.c_str(), told.want());
    case Ask::one_of:
    case Ask::bits:
    case Ask::at_least:
    case Ask::at_most:
      return "set " + name + " " + std::string(rule.why);
    default:
      return gain_advice(told);
  }
}

// Why there is no value: not yet, not in this firmware, or perhaps not.
std::string silence(const Told& told) {
  std::string names(told.rule.names[0].name);
  if (told.rule.count() > 1) names += " nor " + std::string(told.rule.names[1].name);
  if (told.answer.lacks == (1u << told.rule.count()) - 1)
    return "this firmware has no parameter " + names + ": it is not one that was tried, see docs/autopilots.md";
  if (told.answer.asking(told.rule)) return "asking the autopilot";
  return "no answer to " + names + " after " + std::to_string(told.answer.asked) +
         " questions: check the link, and that the firmware has this parameter";
}

}  // namespace

double wanted(const ParameterRule& rule, const Vehicle& vehicle, double untold_delay) {
  const auto& [kp, kd] = std::pair(vehicle.controller.kp, vehicle.controller.kd);
  switch (rule.ask) {
    case Ask::k_d_horizontal:
      return kd.horizontal;
    case Ask::k_p_horizontal:
      return kp.horizontal / kd.horizontal;
    case Ask::k_d_vertical:
      return kd.vertical;
    case Ask::k_p_vertical:
      return kp.vertical / kd.vertical;
    case Ask::k_i_horizontal:
      return vehicle.controller.velocity_integrator.horizontal;
    case Ask::k_i_vertical:
      return vehicle.controller.velocity_integrator.vertical;
    case Ask::v_max:
      return vehicle.limits.v_max;
    case Ask::a_max:
      return vehicle.limits.a_max;
    case Ask::lean:
    case Ask::lean_or_zero:
      return std::atan(std::numbers::sqrt2 * vehicle.limits.a_max / kGravity) / kDegree;
    case Ask::delay:
      return untold_delay;
    case Ask::time_out:
      return std::min(rule.bound, kLastMotion - rule.late);
    default:
      return rule.bound;
  }
}

std::vector<ParameterFinding> judge_parameters(const AutopilotProfile& autopilot, const ParameterValues& values,
                                               const Vehicle& vehicle, double untold_delay) {
  std::vector<ParameterFinding> findings;
  double velocity_gain = 0;  // the last one, which stands before its position gain
  for (std::size_t n = 0; n < autopilot.rules.size(); ++n) {
    const Told told{autopilot.rules[n], values[n], vehicle, untold_delay, velocity_gain};
    const auto& value = told.answer.value;
    if (is_velocity_gain(told.rule.ask)) velocity_gain = value.value_or(0);
    if (told.rule.need == Need::file || (told.rule.need == Need::if_it_has && !value)) continue;
    ParameterFinding finding{told.name().name, required(told), false, told.answer.asking(told.rule), value, {}};
    finding.good = value && good(told);
    if (!finding.good) finding.advice = value ? advice(told) : silence(told);
    findings.push_back(std::move(finding));
  }
  return findings;
}

std::string forbidding_parameter(const AutopilotProfile& autopilot, const ParameterValues& values,
                                 const Vehicle& vehicle, double untold_delay, bool or_unknown) {
  for (const ParameterFinding& finding : judge_parameters(autopilot, values, vehicle, untold_delay)) {
    if (finding.good || !finding.required || !(finding.value || or_unknown)) continue;
    const std::string name(finding.name);
    if (finding.asking) return "no value of " + name + " from the autopilot yet";
    return finding.value ? formatted("%s is %g: %s", name.c_str(), *finding.value, finding.advice.c_str())
                         : finding.advice;
  }
  return "";
}

}  // namespace backwash::firmware_bridge

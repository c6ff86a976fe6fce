// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/parameters.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/types/formatted.hpp"
#include "core/types/geometry.hpp"

namespace backwash::firmware_bridge {
namespace {

enum class Kind : std::uint8_t {
  time_out,  // s, above 0; control is not taken beyond `bound`; unwise where it and `late` are beyond kLastMotion
  one_of,    // an integer n with bit n of `bound`
  bits,      // an integer with all bits of `bound`
  // Against the vehicle file; `bound`: units of the parameter in one of ours.
  k_d_horizontal,  // velocity gain
  k_p_horizontal,  // position gain: k_p over the velocity gain
  k_d_vertical,
  k_p_vertical,
  v_max,
  a_max,
  lean,  // that of a_max along both horizontal axes; both firmwares bound g·tan(lean), whatever is asked upwards
  lean_or_zero,  // the same; 0: another parameter's
  delay,  // of ODOMETRY, ms: what the line adds, and up to kLatestVio of the VIO's own; required where there is one
};

struct Rule {
  std::string_view name;
  bool required;
  Kind kind;
  double bound;
  const char* advice;  // of one_of and bits
  double late = 0;     // s: how much later than a time_out says the autopilot may act
};

constexpr int any(std::initializer_list<int> allowed) {
  int mask = 0;
  for (const int n : allowed) mask |= 1 << n;
  return mask;
}

constexpr Rule kPx4[] = {
    // Looked at ten times a second, and acted upon by the commander's next loop of 10 ms.
    {"COM_OF_LOSS_T", true, Kind::time_out, 0.5, "", 0.11},
    {"COM_OBL_RC_ACT", true, Kind::one_of, any({4, 5}),
     "set COM_OBL_RC_ACT to 4 (land) or 5 (hold): 0 to 2 drift, 3 climbs and returns, 6 and 7 drop the vehicle"},
    {"MPC_XY_VEL_P_ACC", true, Kind::k_d_horizontal, 1, ""},
    {"MPC_XY_P", true, Kind::k_p_horizontal, 1, ""},
    {"MPC_Z_VEL_P_ACC", true, Kind::k_d_vertical, 1, ""},
    {"MPC_Z_P", true, Kind::k_p_vertical, 1, ""},
    {"MPC_XY_VEL_MAX", true, Kind::v_max, 1, ""},
    {"MPC_Z_VEL_MAX_UP", true, Kind::v_max, 1, ""},
    {"MPC_Z_VEL_MAX_DN", true, Kind::v_max, 1, ""},
    {"MPC_TILTMAX_AIR", true, Kind::lean, 1, ""},
    {"EKF2_EV_DELAY", true, Kind::delay, 1000, ""},
    {"COM_RC_OVERRIDE", false, Kind::bits, 2,
     "add 2 to COM_RC_OVERRIDE: without it the pilot's sticks do not take over in offboard"},
    {"NAV_DLL_ACT", false, Kind::one_of, any({0, 1, 3}),
     "set NAV_DLL_ACT to 0 (none), 1 (hold) or 3 (land): 2 climbs and returns, 5 and 6 drop the vehicle"},
    {"NAV_RCL_ACT", false, Kind::one_of, any({0, 1, 3}),
     "set NAV_RCL_ACT to 1 (hold) or 3 (land): 2 climbs and returns, 5 and 6 drop the vehicle"},
    {"COM_LOW_BAT_ACT", false, Kind::one_of, any({0, 2}), "set COM_LOW_BAT_ACT to 2 (land): 1 and 3 climb and return"},
    {"EKF2_EV_CTRL", false, Kind::bits, 1 + 2 + 8,
     "set EKF2_EV_CTRL to 15: the estimator must take position, height and heading from the VIO"},
    {"EKF2_HGT_REF", false, Kind::one_of, any({3}),
     "set EKF2_HGT_REF to 3 (vision): rotor wash spoils the barometer indoors"},
};

constexpr Rule kArduPilot[] = {
    {"GUID_TIMEOUT", true, Kind::time_out, 0.3, ""},
    {"PSC_VELXY_P", true, Kind::k_d_horizontal, 1, ""},
    {"PSC_POSXY_P", true, Kind::k_p_horizontal, 1, ""},
    {"PSC_VELZ_P", true, Kind::k_d_vertical, 1, ""},
    {"PSC_POSZ_P", true, Kind::k_p_vertical, 1, ""},
    {"WPNAV_SPEED", true, Kind::v_max, 100, ""},
    {"WPNAV_SPEED_UP", true, Kind::v_max, 100, ""},
    {"WPNAV_SPEED_DN", true, Kind::v_max, 100, ""},
    {"WPNAV_ACCEL", true, Kind::a_max, 100, ""},
    {"WPNAV_ACCEL_Z", true, Kind::a_max, 100, ""},
    {"ANGLE_MAX", true, Kind::lean, 100, ""},
    {"PSC_ANGLE_MAX", true, Kind::lean_or_zero, 1, ""},
    {"VISO_DELAY_MS", true, Kind::delay, 1000, ""},
    {"VISO_TYPE", false, Kind::one_of, any({1, 2, 3}),
     "set VISO_TYPE to 1 (MAVLink) and restart it: without it ODOMETRY is not read"},
    {"EK3_SRC1_POSXY", false, Kind::one_of, any({6}),
     "set EK3_SRC1_POSXY to 6 (external navigation): the estimator must follow the VIO"},
    {"EK3_SRC1_POSZ", false, Kind::one_of, any({6}),
     "set EK3_SRC1_POSZ to 6 (external navigation): rotor wash spoils the barometer indoors"},
    {"EK3_SRC1_YAW", false, Kind::one_of, any({6}),
     "set EK3_SRC1_YAW to 6 (external navigation): a compass indoors turns the two frames apart"},
    {"FS_EKF_ACTION", false, Kind::one_of, any({1, 3}),
     "set FS_EKF_ACTION to 1 or 3 (land): without a position nothing else is left"},
    {"FS_THR_ENABLE", false, Kind::one_of, any({0, 3}),
     "set FS_THR_ENABLE to 3 (land), or to 0 without a remote control: the others may climb and return"},
    {"FS_GCS_ENABLE", false, Kind::one_of, any({0, 5}),
     "set FS_GCS_ENABLE to 0 (none) or 5 (land): the others may climb and return"},
    {"RTL_ALT", false, Kind::one_of, any({0}),
     "set RTL_ALT to 0 (the height at the time, but 2 m): otherwise the pilot's RTL first climbs to it, ceiling or "
     "not"},
    {"BATT_FS_LOW_ACT", false, Kind::one_of, any({0, 1, 7}),
     "set BATT_FS_LOW_ACT to 0 (none) or 1 (land): 2 to 4 and 6 may climb and return, 5 drops the vehicle"},
    {"BATT_FS_CRT_ACT", false, Kind::one_of, any({0, 1, 7}),
     "set BATT_FS_CRT_ACT to 0 (none) or 1 (land): 2 to 4 and 6 may climb and return, 5 drops the vehicle"},
};

static_assert(std::size(kPx4) <= kMostParameters && std::size(kArduPilot) <= kMostParameters);

std::span<const Rule> rules(Autopilot autopilot) noexcept {
  if (autopilot == Autopilot::kPx4) return kPx4;
  if (autopilot == Autopilot::kArduPilot) return kArduPilot;
  return {};
}

template <std::size_t kCount>
constexpr std::array<std::string_view, kCount> names_of(const Rule (&all)[kCount]) {
  std::array<std::string_view, kCount> names;
  std::ranges::transform(all, names.begin(), &Rule::name);
  return names;
}
constexpr auto kPx4Names = names_of(kPx4);
constexpr auto kArduPilotNames = names_of(kArduPilot);

// What parameters are judged against.
struct Against {
  const Vehicle& vehicle;
  double untold_delay;  // s
};

// The value that `kind` asks of the parameter; for gains what the product with the velocity gain asks.
double wanted(const Rule& rule, const Against& against) {
  const Vehicle& vehicle = against.vehicle;
  const auto& [kp, kd] = std::pair(vehicle.controller.kp, vehicle.controller.kd);
  switch (rule.kind) {
    case Kind::k_d_horizontal:
      return kd.horizontal;
    case Kind::k_p_horizontal:
      return kp.horizontal / kd.horizontal;
    case Kind::k_d_vertical:
      return kd.vertical;
    case Kind::k_p_vertical:
      return kp.vertical / kd.vertical;
    case Kind::v_max:
      return rule.bound * vehicle.limits.v_max;
    case Kind::a_max:
      return rule.bound * vehicle.limits.a_max;
    case Kind::lean:
    case Kind::lean_or_zero:
      return rule.bound * std::atan(std::numbers::sqrt2 * vehicle.limits.a_max / kGravity) * 180 / std::numbers::pi;
    case Kind::delay:
      return rule.bound * against.untold_delay;
    case Kind::time_out:
      return std::min(rule.bound, kLastMotion - rule.late);
    default:
      return rule.bound;
  }
}

// k_p = P_position · P_velocity as both firmwares cascade them; `velocity`: its deviation from the vehicle file, as a
// ratio.
bool good(const Rule& rule, double value, double velocity, const Against& against) {
  const double want = wanted(rule, against);
  // The link carries floats: 0.3 comes as 0.30000001, 1.3 as 1.29999995.
  const auto [told, limit] = std::pair(static_cast<float>(value), static_cast<float>(want));
  switch (rule.kind) {
    case Kind::time_out:
      return value > 0 && told <= limit;
    case Kind::one_of:
      return value >= 0 && value < 31 && value == std::floor(value) &&
             (static_cast<int>(want) >> static_cast<int>(value) & 1) != 0;
    case Kind::bits:
      return value >= 0 && value < 1 << 30 &&
             (static_cast<int>(value) & static_cast<int>(want)) == static_cast<int>(want);
    case Kind::k_d_horizontal:
    case Kind::k_d_vertical:
      return std::abs(value / want - 1) <= kGainTolerance;
    case Kind::k_p_horizontal:
    case Kind::k_p_vertical:
      return std::abs(value / want * velocity - 1) <= kGainTolerance;
    case Kind::v_max:
    case Kind::a_max:
    case Kind::lean:
      return told >= limit;
    case Kind::lean_or_zero:
      return told == 0 || told >= limit;
    case Kind::delay:  // an ODOMETRY that waits for no set-point is a fifth faster
      return value >= 0.8 * want && value <= want + rule.bound * kLatestVio;
  }
  return false;
}

// Control is not taken without it; a time-out that only makes the last motion longer than it should be is told.
bool required(const Rule& rule, std::optional<double> value, const Against& against) {
  if (rule.kind == Kind::delay) return rule.required && against.untold_delay > 0;
  const bool only_unwise = rule.kind == Kind::time_out && value && *value > 0 &&
                           static_cast<float>(*value) <= static_cast<float>(rule.bound);
  return rule.required && !only_unwise;
}

std::string advice(const Rule& rule, const Against& against) {
  const std::string name(rule.name);
  switch (rule.kind) {
    case Kind::time_out:
      return formatted("set %s above 0 and to %.3g s at most: for its time%s the vehicle flies on when the daemon dies",
                       name.c_str(), wanted(rule, against),
                       rule.late > 0 ? formatted(", and up to %.3g s more,", rule.late).c_str() : "");
    case Kind::one_of:
    case Kind::bits:
      return rule.advice;
    case Kind::v_max:
    case Kind::a_max:
      return formatted("set %s to %.3g or more: the vehicle file's %s is planned with", name.c_str(),
                       wanted(rule, against), rule.kind == Kind::v_max ? "v_max" : "a_max");
    case Kind::lean:
    case Kind::lean_or_zero:
      return formatted("set %s to %.0f or more%s: the vehicle file's a_max along both axes leans so far", name.c_str(),
                       std::ceil(wanted(rule, against)), rule.kind == Kind::lean ? "" : ", or to 0");
    case Kind::delay:
      return formatted("set %s to %.0f ms, and the VIO's own delay: so long are set-point and ODOMETRY on the line",
                       name.c_str(), wanted(rule, against));
    default:
      return formatted("set %s to %.3g, or the vehicle file to the gains that fly: its sets are computed for them",
                       name.c_str(), wanted(rule, against));
  }
}

}  // namespace

std::span<const std::string_view> parameter_names(Autopilot autopilot) noexcept {
  if (autopilot == Autopilot::kPx4) return kPx4Names;
  if (autopilot == Autopilot::kArduPilot) return kArduPilotNames;
  return {};
}

std::vector<ParameterFinding> judge_parameters(Autopilot autopilot, const ParameterValues& values,
                                               const Vehicle& vehicle, double untold_delay) {
  const Against against{vehicle, untold_delay};
  std::vector<ParameterFinding> findings;
  double velocity = 1;  // of the last velocity gain, which stands before its position gain
  for (const Rule& rule : rules(autopilot)) {
    const auto value = values[findings.size()];
    ParameterFinding finding{rule.name, required(rule, value, against), false, value, {}};
    finding.good = value && good(rule, *value, velocity, against);
    if (rule.kind == Kind::k_d_horizontal || rule.kind == Kind::k_d_vertical)
      velocity = value.value_or(0) / wanted(rule, against);
    if (!value)
      finding.advice = "the autopilot has not answered: check the link, and that its firmware has this parameter";
    else if (!finding.good)
      finding.advice = advice(rule, against);
    findings.push_back(std::move(finding));
  }
  return findings;
}

std::string forbidding_parameter(Autopilot autopilot, const ParameterValues& values, const Vehicle& vehicle,
                                 double untold_delay, bool or_unknown) {
  for (const ParameterFinding& finding : judge_parameters(autopilot, values, vehicle, untold_delay)) {
    if (finding.good || !finding.required || !(finding.value || or_unknown)) continue;
    const std::string name(finding.name);
    if (!finding.value) return "no value of " + name + " from the autopilot yet";
    return formatted("%s is %g: %s", name.c_str(), *finding.value, finding.advice.c_str());
  }
  return "";
}

}  // namespace backwash::firmware_bridge

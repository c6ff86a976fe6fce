// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/plan/firmware_gains.hpp"

#include <cstdio>

#include "services/backwash/verb.hpp"

namespace backwash::services {

using firmware_bridge::Ask;

namespace {

/// Integral gains that fly, both of them or neither: along z the file's where no parameter is it. What is left out.
std::string take_integrals(const Firmware& firmware, Vehicle& vehicle) {
  auto& own = vehicle.controller.velocity_integrator;
  const auto gain = [&](Ask ask, double without) {
    const auto found = firmware.values.find(firmware.name(ask));
    return found == firmware.values.end() ? without : found->second;
  };
  const Vehicle::HorizontalVertical flown{gain(Ask::k_i_horizontal, own.horizontal),
                                          gain(Ask::k_i_vertical, own.vertical)};
  if ((flown.horizontal > 0) == (flown.vertical > 0)) {
    own = flown;
    return "";
  }
  char text[32];
  std::snprintf(text, sizeof text, "%g", flown.horizontal);
  return firmware.name(Ask::k_i_horizontal) + " " + text + " is left out: along z controller.velocity_integrator is " +
         (flown.vertical > 0 ? "not 0" : "0") + ", and both integrate or neither does";
}

}  // namespace

std::string Firmware::name(Ask ask) const {
  std::string name;
  for (const auto& rule : autopilot->rules)
    if (rule.ask == ask)
      for (std::size_t n = 0; n < rule.count(); ++n)
        if (name = rule.names[n].name; values.contains(name)) return name;
  return name;
}

std::optional<Granted> least_granted(const std::map<std::string, double>& values, Ask ask) {
  std::optional<Granted> least;
  for (const auto* autopilot : firmware_bridge::autopilots())
    for (const auto& rule : autopilot->rules)
      for (std::size_t n = 0; n < rule.count() && rule.ask == ask; ++n)
        if (const auto found = values.find(std::string(rule.names[n].name)); found != values.end() && found->second > 0)
          if (const double value = found->second / rule.names[n].scale; !least || value < least->value)
            least = Granted{found->first, value};
  return least;
}

Firmware take_gains(const std::map<std::string, double>& values, const std::string& path, Vehicle& vehicle) {
  Firmware firmware{nullptr, values, {}};
  std::string tried;
  for (const auto* autopilot : firmware_bridge::autopilots()) {
    firmware.autopilot = autopilot;
    const std::string velocity = firmware.name(Ask::k_d_horizontal);
    if (!firmware.values.contains(velocity)) {
      if (!velocity.empty()) tried += (tried.empty() ? "" : " nor ") + velocity;
      continue;
    }
    const auto gain = [&](Ask ask) {
      const auto found = firmware.values.find(firmware.name(ask));
      if (found == firmware.values.end() || !(found->second > 0))
        throw Failure(kBadData, path + ":1: " + firmware.name(ask) +
                                    " is missing or not above 0; save all parameters of the autopilot");
      return found->second;
    };
    vehicle.controller.kd = {gain(Ask::k_d_horizontal), gain(Ask::k_d_vertical)};
    vehicle.controller.kp = {gain(Ask::k_p_horizontal) * gain(Ask::k_d_horizontal),
                             gain(Ask::k_p_vertical) * gain(Ask::k_d_vertical)};
    firmware.left_out = take_integrals(firmware, vehicle);
    return firmware;
  }
  throw Failure(kBadData, path + ":1: has neither " + tried + "; save all parameters of the autopilot");
}

}  // namespace backwash::services

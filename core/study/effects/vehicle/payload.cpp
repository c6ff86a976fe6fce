// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"
#include "core/types/formatted.hpp"

namespace backwash::study {
namespace {

/// Which rotors face each other depends on the autopilot: 1-2 and 3-4, 1-3 and 2-4, or 1-4 and 2-3.
constexpr std::size_t kFacing[3][4] = {{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}};

std::vector<DesignColumn> overweight(const Windows& ws, const Scale& scale) {
  return {missing_thrust(ws, scale.anchor.empty() ? 0.0 : scale.anchor[0])};
}

std::vector<DesignColumn> facing_rotors(const Windows& ws, const Scale& pairing) {
  const auto& pair = kFacing[static_cast<std::size_t>(pairing.value)];
  std::vector<DesignColumn> columns;
  for (const std::size_t k : {std::size_t{0}, std::size_t{2}}) {
    const auto first = static_cast<Channel>(kMotor1 + pair[k]), second = static_cast<Channel>(kMotor1 + pair[k + 1]);
    columns.push_back({{{first, std::vector<double>(ws.size(), 1.0)}, {second, std::vector<double>(ws.size(), -1.0)}}});
  }
  return columns;
}

/// The missing share of the thrust, 1 − 1/(1 + m), as m.
double excess_of_mass(double missing) { return missing / (1 - missing); }
/// Half of ln (1 + m)/(1 − m) as m.
double share_of_pair(double half_ln) { return std::tanh(half_ln); }

std::vector<SimulationTerm> needed_of_rotors(const FittedForm& fitted, const Observations&) {
  const auto& pair = kFacing[static_cast<std::size_t>(fitted.scale.value)];
  SimulationTerm term{SimulationTerm::Kind::rotor_needs, std::vector<double>(4, 0)};
  term.value[pair[0]] = fitted.theta[0];
  term.value[pair[1]] = -fitted.theta[0];
  term.value[pair[2]] = fitted.theta[1];
  term.value[pair[3]] = -fitted.theta[1];
  return {term};
}

}  // namespace

/// A mass that the vehicle file does not hold, above the middle or beside it.
Effect payload() {
  return {
      .name = "payload",
      .at_rotors = AtRotors::weight,
      .forms = {{.formula = "thrust per mass / (1 + m), m the relative excess of mass",
                 .parameters = {"m"},
                 .priors = {{kPriors.typical_share, -HUGE_VAL, 1, "no mass is infinite"}},
                 .constant = true,
                 .by_size = true,
                 .floor = 0.01,
                 .needs = {Source::thrust},
                 .columns = overweight,
                 .extend = flown_range,
                 .simulate = simulates(SimulationTerm::Kind::thrust_share),
                 .meanings = {excess_of_mass}},
                {.formula = "an off-centre weight: rotors that face each other need (1 + m) and (1 - m) of the mean",
                 .parameters = {"m_first", "m_second"},
                 .priors = {{kPriors.typical_share, -1, 1, "no rotor pulls down"},
                            {kPriors.typical_share, -1, 1, "no rotor pulls down"}},
                 .scale_name = "pairing",
                 .scales = scales_of({0, 1, 2}),
                 .integer_scale = true,
                 .constant = true,
                 .floor = 0.02,
                 .needs = {Source::motors},
                 .columns = facing_rotors,
                 .simulate = needed_of_rotors,
                 .meanings = {share_of_pair, share_of_pair}}},
      .remedy = [](auto& fitted, auto& v) {
        if (fitted.form.needs.front() == Source::motors)
          return with_craft("Move the weight, or the battery, towards the middle of the craft.");
        const double weighs = v.body.mass / (1 - fitted.theta[0]);
        return in_vehicle({{"body.mass", v.body.mass, weighs}},
                          formatted("Your vehicle weighs %.3g kg, not %.3g", weighs, v.body.mass));
      }};
}

}  // namespace backwash::study

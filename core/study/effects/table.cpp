// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/table.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::study {

// The table: an effect's file, and its line here in both lists.
Effect ground_thrust(), ceiling(), wall_attraction(), recirculation(), forward_speed(), battery_sag(), thrust_slope(),
    payload(), trim(), draft(), rotor_drag(), inflow(), actuator_lag(), command_latency(), imu_drift(), vibration(),
    map_offset(), heavy_tails(), propeller_damage(), rotor_sensor_fault();

namespace {

constexpr Effect (*kEffects[])() = {
    ground_thrust, ceiling,   wall_attraction, recirculation, forward_speed,    battery_sag,       thrust_slope,
    payload,       trim,      draft,           rotor_drag,    inflow,           actuator_lag,      command_latency,
    imu_drift,     vibration, map_offset,      heavy_tails,   propeller_damage, rotor_sensor_fault};

}  // namespace

const std::string& Form::cause() const { return effect->name; }

double Form::prior_nats(std::span<const double> sizes) const {
  double square = 0;
  for (std::size_t k = 0; k < priors.size(); ++k) square += std::pow(sizes[k] / priors[k].typical, 2);
  return 0.5 * static_cast<double>(priors.size() + 1) * std::log1p(square);
}

std::vector<Scale> scales_of(std::initializer_list<double> values) {
  std::vector<Scale> scales;
  for (const double v : values) scales.push_back({v});
  return scales;
}

const std::vector<Effect>& effects() {
  static const std::vector<Effect> all = [] {
    std::vector<Effect> made;
    for (const auto make : kEffects) made.push_back(make());
    for (Effect& e : made)
      for (Form& f : e.forms) {
        f.effect = &e;
        for (Form& shape : f.shapes) {
          shape.effect = &e;
          shape.parameters = f.parameters;
        }
      }
    return made;
  }();
  return all;
}

const std::vector<const Form*>& catalogue() {
  static const std::vector<const Form*> all = [] {
    std::vector<const Form*> forms;
    for (const Effect& e : effects())
      for (const Form& f : e.forms) forms.push_back(&f);
    return forms;
  }();
  return all;
}

std::optional<std::string> why_not_tested(const Form& form, const Observations& seen) {
  for (const Source needed : form.needs)
    if (!seen.has(needed)) return seen.missing.at(needed);
  if (form.not_flown)
    if (auto why = form.not_flown(seen)) return why;
  if (seen.windows.empty()) return "no good window";
  for (const auto& column : form.columns(seen.windows, form.scales.front()))
    if (std::any_of(column.parts.begin(), column.parts.end(), [&](auto& p) { return seen.measured(p.channel); }))
      return std::nullopt;
  if (!(seen.has(Source::thrust) && seen.has(Source::attitude)) && !seen.has(Source::setpoints))
    return "without thrust and attitude or set-points no push shows, and other effects in hover only";
  if (!seen.has(Source::acceleration))
    return seen.missing.at(Source::acceleration) + ": of differentiated motion the gusts are not told from its noise";
  return "no window measures it";
}

}  // namespace backwash::study

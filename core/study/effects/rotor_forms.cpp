// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/forms.hpp"

namespace backwash::study {
namespace {

Column one_rotor(Channel first, const Windows& ws, double rotor, bool contrast) {
  Column column;
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = (i == static_cast<std::size_t>(rotor) ? 1.0 : 0.0) - (contrast ? 0.25 : 0.0);
    if (x != 0) column.parts.push_back({static_cast<Channel>(first + i), std::vector<double>(ws.size(), x)});
  }
  return column;
}

const std::vector<double> kRotors = {0, 1, 2, 3};

}  // namespace

std::vector<Form> rotor_forms() {
  return {
      {.cause = "vibration",
       .formula = "ln power at all rotors' rates + P",
       .parameters = {"P_ln"},
       .constant = true,
       .floor = 0.25,
       .one_sided = true,
       .columns =
           [](const Windows& ws, double) {
             Column c;
             for (const double rotor : kRotors)
               c.parts.push_back({static_cast<Channel>(kLine1 + static_cast<std::size_t>(rotor)),
                                  std::vector<double>(ws.size(), 1.0)});
             return std::vector{c};
           }},
      {.cause = "propeller_damage",
       .formula = "one rotor needs (1 + d) of the others' thrust command",
       .parameters = {"d"},
       .scale_name = "rotor",
       .scales = kRotors,
       .integer_scale = true,
       .constant = true,
       .least = 0.04,
       .one_sided = true,
       .columns = [](const Windows& ws, double rotor) { return std::vector{one_rotor(kMotor1, ws, rotor, true)}; }},
      {.cause = "propeller_damage",
       .formula = "one rotor needs (1 + d) of the others' thrust command and shakes at its rate",
       .parameters = {"d", "P_ln"},
       .scale_name = "rotor",
       .scales = kRotors,
       .integer_scale = true,
       .constant = true,
       .least = 0.04,
       .one_sided = true,
       .columns =
           [](const Windows& ws, double rotor) {
             return std::vector{one_rotor(kMotor1, ws, rotor, true), one_rotor(kLine1, ws, rotor, false)};
           }},
      {.cause = "payload",
       .formula = "an off-centre weight: rotors that face each other need (1 + m) and (1 - m) of the mean",
       .parameters = {"m_first", "m_second"},
       .scale_name = "pairing",
       .scales = {0, 1, 2},
       .integer_scale = true,
       .constant = true,
       .floor = 0.02,
       .columns =
           [](const Windows& ws, double pairing) {
             // Which rotors face each other depends on the autopilot: 1-2 and 3-4, 1-3 and 2-4, or 1-4 and 2-3.
             constexpr std::size_t kFacing[3][4] = {{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}};
             const auto& pair = kFacing[static_cast<std::size_t>(pairing)];
             std::vector<Column> columns;
             for (const std::size_t k : {std::size_t{0}, std::size_t{2}}) {
               const auto first = static_cast<Channel>(kMotor1 + pair[k]);
               const auto second = static_cast<Channel>(kMotor1 + pair[k + 1]);
               columns.push_back(
                   {{{first, std::vector<double>(ws.size(), 1.0)}, {second, std::vector<double>(ws.size(), -1.0)}}});
             }
             return columns;
           }},
      {.cause = "rotor_sensor_fault",
       .formula = "one rotor's rpm^2 reads (1 + e) of what its command gives",
       .parameters = {"e"},
       .scale_name = "rotor",
       .scales = kRotors,
       .integer_scale = true,
       .constant = true,
       .least = 0.06,
       .columns = [](const Windows& ws, double rotor) { return std::vector{one_rotor(kRpm1, ws, rotor, true)}; }},
      {.cause = "rotor_sensor_fault",
       .formula = "a share of one rotor's rpm readings is stuck or missing",
       .parameters = {"share"},
       .scale_name = "rotor",
       .scales = kRotors,
       .integer_scale = true,
       .constant = true,
       .least = 0.01,
       .one_sided = true,
       .columns = [](const Windows& ws, double rotor) { return std::vector{one_rotor(kDropout1, ws, rotor, false)}; }}};
}

}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "core/field/extension.hpp"
#include "core/study/effects/forms.hpp"

namespace backwash::study {
namespace {

using field::near_surface;

/// Mean of the power, not the power of the mean: a window holds a start or a stop.
double speed_power(const WindowRow& w, double power) {
  double sum = 0;
  for (const double v : w.speeds) sum += std::pow(v, power) / kPoints;
  return sum;
}

/// The same where the gusts are: a window that climbs away from the floor has most of its variance while it is slow.
double gusts_speed_power(const WindowRow& w, double power) {
  double sum = 0;
  for (std::size_t k = 0; k < kPoints; ++k) sum += w.shares[k] * std::pow(w.speeds[k], power);
  return sum;
}

const std::vector<double> kLengths = {0.08, 0.15, 0.3, 0.6};

}  // namespace

std::vector<Form> surface_forms() {
  return {{.cause = "ground_thrust",
           .formula = "z push A exp(-(h - 0.4 m)/L), h the height over the surface below",
           .parameters = {"A_mps2"},
           .scale_name = "L_m",
           .scales = kLengths,
           .by_place = true,
           .floor = 0.02,
           .columns =
               [](const Windows& ws, double length) {
                 return std::vector{in(kMeanZ, ws, [&](auto& w) {
                   return along(w, [&](auto& at) { return near_surface(at.height, field::kSurfaceReference, length); });
                 })};
               }},
          {.cause = "ceiling",
           .formula = "z push A exp(-(d - 0.3 m)/L), d the gap to the surface above",
           .parameters = {"A_mps2"},
           .scale_name = "L_m",
           .scales = kLengths,
           .by_place = true,
           .floor = 0.02,
           .columns =
               [](const Windows& ws, double length) {
                 return std::vector{in(kMeanZ, ws, [&](auto& w) {
                   return along(
                       w, [&](auto& at) { return near_surface(at.ceiling_gap, field::kCeilingReference, length); });
                 })};
               }},
          {.cause = "ceiling",
           .formula = "ln variance + B exp(-(d - 0.3 m)/L), d the gap to the surface above",
           .parameters = {"B_ln"},
           .scale_name = "L_m",
           .scales = {0.15, 0.3, 0.6},
           .floor = 0.12,
           .columns =
               [](const Windows& ws, double length) {
                 return std::vector{in_variance(ws, [&](auto& w) {
                   return along(
                       w, [&](auto& at) { return near_surface(at.ceiling_gap, field::kCeilingReference, length); });
                 })};
               }},
          {.cause = "wall_attraction",
           .formula = "push A exp(-(d - 0.4 m)/L) towards each wall at distance d",
           .parameters = {"A_mps2"},
           .scale_name = "L_m",
           .scales = kLengths,
           .by_place = true,
           .floor = 0.02,
           .columns = [](const Windows& ws, double length) {
             return std::vector{level(ws, [&](auto& w) {
               return along(w, [&](auto& at) {
                 return towards(at.walls, [&](double d) { return near_surface(d, field::kSurfaceReference, length); });
               });
             })};
           }}};
}

Column missing_thrust(const Windows& ws, const std::function<double(const WindowRow&)>& share) {
  // g for T/m: the measured thrust answers the mean gust, so it would explain the residual by itself.
  return {{{kMeanZ, values(ws, [&](auto& w) { return -share(w) * kGravity; })},
           {kThrustDelay, values(ws, [&](auto& w) { return -share(w) * w.delay_gain[1]; })},
           {kThrustSlope, values(ws, [&](auto& w) { return -share(w) * w.slope_gain[1]; })}}};
}

std::vector<Form> vehicle_forms() {
  return {
      {.cause = "battery_sag",
       .formula = "thrust (1 - s (V0 - V)/Vm), V0 the highest and Vm the mean voltage flown",
       .parameters = {"s"},
       .floor = 0.01,
       .columns =
           [](const Windows& ws, double) {
             double highest = 0, mean = 1e-6;
             for (const auto& w : ws) highest = std::max(highest, w.voltage), mean += w.voltage / ws.size();
             return std::vector{missing_thrust(ws, [&](auto& w) { return (highest - w.voltage) / mean; })};
           }},
      {.cause = "payload",
       .formula = "thrust per mass (1 - m), m the relative excess of mass",
       .parameters = {"m"},
       .constant = true,
       .floor = 0.01,
       .columns = [](const Windows& ws, double) { return std::vector{missing_thrust(ws, [](auto&) { return 1.0; })}; }},
      {.cause = "thrust_slope",
       .formula = "a change of the thrust command is worth (1 + s) of the modelled",
       .parameters = {"s"},
       .constant = true,
       .least = 0.03,
       .columns =
           [](const Windows& ws, double) {
             return std::vector{Column{{{kThrustDelay, values(ws, [](auto& w) { return w.delay_gain[1]; })},
                                        {kThrustSlope, values(ws, [](auto& w) { return w.slope_gain[1]; })}}}};
           }},
      {.cause = "actuator_lag",
       .formula = "thrust follows its command tau later",
       .parameters = {"tau_s"},
       .constant = true,
       .least = 0.01,
       .one_sided = true,
       .columns =
           [](const Windows& ws, double) {
             return std::vector{Column{{{kThrustDelay, values(ws, [](auto& w) { return w.delay_gain[0]; })},
                                        {kThrustSlope, values(ws, [](auto& w) { return w.slope_gain[0]; })}}}};
           }},
      {.cause = "command_latency",
       .formula = "set-points act later by this, level axes",
       .parameters = {"latency_s"},
       .constant = true,
       .least = 0.015,
       .unknowable = [](const Observations& seen) { return seen.row_period / 4; },
       .columns =
           [](const Windows& ws, double) {
             return std::vector{in(kCommandDelayH, ws, [](auto& w) { return w.command_gain[0]; })};
           }},
      {.cause = "rotor_drag",
       .formula = "push -k v, level",
       .parameters = {"k_per_s"},
       .floor = 0.01,
       .columns = [](const Windows& ws,
                     double) { return std::vector{level(ws, [](auto& w) -> Vec3 { return -w.v_W; })}; }},
      {.cause = "forward_speed",
       .formula = "z push C (v/1 m/s)^2",
       .parameters = {"C_mps2"},
       .floor = 0.02,
       .columns = [](const Windows& ws,
                     double) { return std::vector{in(kMeanZ, ws, [](auto& w) { return speed_power(w, 2); })}; }},
      {.cause = "forward_speed",
       .formula = "ln variance + B (v/1 m/s)^n",
       .parameters = {"B_ln"},
       .scale_name = "n",
       .scales = {1, 2},
       .floor = 0.12,
       .columns = [](const Windows& ws, double power) {
         return std::vector{in_variance(ws, [&](auto& w) { return gusts_speed_power(w, power); })};
       }}};
}

std::vector<Column> body_drift(const Windows& ws, const std::function<double(const WindowRow&)>& amount) {
  std::vector<Column> columns;
  for (int i = 0; i < 3; ++i) {
    Column c = level(ws, [&](auto& w) -> Vec3 { return amount(w) * w.R_WB.col(i); });
    c.parts.push_back({kMeanZ, values(ws, [&](auto& w) { return amount(w) * w.R_WB(2, i); })});
    columns.push_back(std::move(c));
  }
  return columns;
}

std::vector<Form> push_forms() {
  return {{.cause = "trim",
           .formula = "constant push fixed to the body",
           .parameters = {"body_x_mps2", "body_y_mps2"},
           .constant = true,
           .floor = 0.02,
           .columns =
               [](const Windows& ws, double) {
                 return std::vector{level(ws, [](auto& w) -> Vec3 { return w.R_WB.col(0); }),
                                    level(ws, [](auto& w) -> Vec3 { return w.R_WB.col(1); })};
               }},
          {.cause = "draft",
           .formula = "constant level push fixed to the world",
           .parameters = {"x_mps2", "y_mps2"},
           .constant = true,
           .floor = 0.02,
           .columns =
               [](const Windows& ws, double) {
                 return std::vector{level(ws, [](auto&) -> Vec3 { return Vec3::UnitX(); }),
                                    level(ws, [](auto&) -> Vec3 { return Vec3::UnitY(); })};
               }},
          {.cause = "imu_drift",
           .formula = "accelerometer bias b t/100 s, fixed to the body",
           .parameters = {"x_mps2_per_100s", "y_mps2_per_100s", "z_mps2_per_100s"},
           .floor = 0.015,
           .columns = [](const Windows& ws, double) { return body_drift(ws, [](auto& w) { return w.t / 100; }); }},
          {.cause = "imu_drift",
           .formula = "accelerometer bias b (T - 25 C)/10 C, fixed to the body",
           .parameters = {"x_mps2_per_10c", "y_mps2_per_10c", "z_mps2_per_10c"},
           .floor = 0.015,
           .columns = [](const Windows& ws, double) {
             return body_drift(ws, [](auto& w) { return (w.temperature - 25) / 10; });
           }}};
}

double offset_code(const Vec3& offset_W) {
  return 1000 * std::round(500 + 1000 * offset_W.x()) + std::round(500 + 1000 * offset_W.y());
}

Vec3 map_offset(double code) {
  const double x = std::floor(code / 1000);
  return {(x - 500) / 1000, (code - 1000 * x - 500) / 1000, 0};
}

namespace {

/// Eight directions, 0.15 and 0.3 m.
std::vector<double> tried_offsets() {
  std::vector<double> codes;
  for (const double length : {0.15, 0.3})
    for (int k = 0; k < 8; ++k)
      codes.push_back(offset_code(length * Vec3(std::cos(M_PI * k / 4), std::sin(M_PI * k / 4), 0)));
  return codes;
}

}  // namespace

std::vector<Form> variance_forms() {
  return {{.cause = "recirculation",
           .formula = "ln variance + B (1 - exp(-t/tau)), t since the flight's start",
           .parameters = {"B_ln"},
           .scale_name = "tau_s",
           .scales = {8, 20, 50},
           .floor = 0.12,
           .columns =
               [](const Windows& ws, double tau) {
                 return std::vector{in_variance(ws, [&](auto& w) { return 1 - std::exp(-w.t / tau); })};
               }},
          {.cause = "map_offset",
           .formula = "ln variance as modelled at the position plus a level offset",
           .parameters = {"share"},
           .scale_name = "offset",
           .scales = tried_offsets(),
           .integer_scale = true,
           .floor = 0.12,
           .one_sided = true,
           .columns =
               [](const Windows& ws, double code) {
                 const Vec3 offset = map_offset(code);
                 Column column;
                 for (const Channel c : kVariances)
                   column.parts.push_back(
                       {c, values(ws, [&](auto& w) { return w.ln_sigma_at(offset)[static_cast<int>(c - kVarX)]; })});
                 return std::vector{column};
               }},
          {.cause = "heavy_tails",
           .formula = "ln kurtosis + K",
           .parameters = {"K_ln"},
           .constant = true,
           .floor = 0.15,
           .one_sided = true,
           .unknowable = [](const Observations&) { return kScatter2 / 2; },  // how much of the wander is within 1 s
           .columns = [](const Windows& ws, double) { return std::vector{in(kTail, ws, [](auto&) { return 1.0; })}; }}};
}

}  // namespace backwash::study

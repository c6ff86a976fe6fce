// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/discrepancy/catalogue.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/field/extension.hpp"

namespace backwash::study::discrepancy {
namespace {

using field::near_surface;

constexpr std::array<Channel, 3> kVariances = {kVarX, kVarY, kVarZ};

template <typename F>
std::vector<double> values(const Windows& windows, F value) {
  std::vector<double> x;
  x.reserve(windows.size());
  for (const auto& w : windows) x.push_back(value(w));
  return x;
}

template <typename F>
Column in(Channel channel, const Windows& windows, F value) {
  return {{{channel, values(windows, value)}}};
}

/// A level vector: its x and y in the mean channels.
template <typename F>
Column level(const Windows& windows, F vector) {
  return {{{kMeanX, values(windows, [&](const WindowRow& w) { return vector(w).x(); })},
           {kMeanY, values(windows, [&](const WindowRow& w) { return vector(w).y(); })}}};
}

/// The same in ln variance along all axes.
template <typename F>
Column in_variance(const Windows& windows, F value) {
  Column column;
  for (const Channel c : kVariances) column.parts.push_back({c, values(windows, value)});
  return column;
}

Vec3 pull(const WindowRow& w, double length) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [distance, direction] : w.around.walls)
    sum += near_surface(distance, field::kSurfaceReference, length) * direction;
  return sum;
}

const std::vector<double> kLengths = {0.08, 0.15, 0.3, 0.6};

std::vector<Form> near_surfaces() {
  return {{.cause = "ground_thrust",
           .formula = "z push A exp(-(h - 0.4 m)/L), h the height over the surface below",
           .parameters = {"A_mps2"},
           .scale_name = "L_m",
           .scales = kLengths,
           .floor = 0.02,
           .columns =
               [](const Windows& ws, double length) {
                 return std::vector{in(kMeanZ, ws, [&](auto& w) {
                   return near_surface(w.around.height, field::kSurfaceReference, length);
                 })};
               }},
          {.cause = "ceiling",
           .formula = "z push A exp(-(d - 0.3 m)/L), d the gap to the surface above",
           .parameters = {"A_mps2"},
           .scale_name = "L_m",
           .scales = kLengths,
           .floor = 0.02,
           .columns =
               [](const Windows& ws, double length) {
                 return std::vector{in(kMeanZ, ws, [&](auto& w) {
                   return near_surface(w.around.ceiling_gap, field::kCeilingReference, length);
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
                   return near_surface(w.around.ceiling_gap, field::kCeilingReference, length);
                 })};
               }},
          {.cause = "wall_attraction",
           .formula = "push A exp(-(d - 0.4 m)/L) towards each wall at distance d",
           .parameters = {"A_mps2"},
           .scale_name = "L_m",
           .scales = kLengths,
           .floor = 0.02,
           .columns = [](const Windows& ws, double length) {
             return std::vector{level(ws, [&](auto& w) { return pull(w, length); })};
           }}};
}

/// −x T/m: a share of the thrust that is missing, seen in the mean and in what a change of the command is worth.
Column missing_thrust(const Windows& ws, const std::function<double(const WindowRow&)>& share) {
  // g for T/m: the measured thrust answers the mean gust, so it would explain the residual by itself.
  return {{{kMeanZ, values(ws, [&](auto& w) { return -share(w) * kGravity; })},
           {kThrustDelay, values(ws, [&](auto& w) { return -share(w) * w.delay_gain[1]; })},
           {kThrustSlope, values(ws, [&](auto& w) { return -share(w) * w.slope_gain[1]; })}}};
}

std::vector<Form> vehicle() {
  return {
      {.cause = "battery_sag",
       .formula = "thrust (1 - s (V0 - V)/V0), V0 the highest voltage seen",
       .parameters = {"s"},
       .floor = 0.01,
       .columns =
           [](const Windows& ws, double) {
             double highest = 1e-6;
             for (const auto& w : ws) highest = std::max(highest, w.voltage);
             return std::vector{missing_thrust(ws, [&](auto& w) { return (highest - w.voltage) / highest; })};
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
                     double) { return std::vector{in(kMeanZ, ws, [](auto& w) { return w.speed * w.speed; })}; }},
      {.cause = "forward_speed",
       .formula = "ln variance + B (v/1 m/s)^n",
       .parameters = {"B_ln"},
       .scale_name = "n",
       .scales = {1, 2},
       .floor = 0.12,
       .columns = [](const Windows& ws, double power) {
         return std::vector{in_variance(ws, [&](auto& w) { return std::pow(w.speed, power); })};
       }}};
}

/// A vector of the body, growing with `amount`, in all mean channels.
std::vector<Column> body_drift(const Windows& ws, const std::function<double(const WindowRow&)>& amount) {
  std::vector<Column> columns;
  for (int i = 0; i < 3; ++i) {
    Column c = level(ws, [&](auto& w) -> Vec3 { return amount(w) * w.R_WB.col(i); });
    c.parts.push_back({kMeanZ, values(ws, [&](auto& w) { return amount(w) * w.R_WB(2, i); })});
    columns.push_back(std::move(c));
  }
  return columns;
}

std::vector<Form> pushes() {
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
           .formula = "accelerometer bias b (t/100 s)^n, fixed to the body",
           .parameters = {"x_mps2_per_100s", "y_mps2_per_100s", "z_mps2_per_100s"},
           .scale_name = "n",
           .scales = {0.5, 1},
           .floor = 0.015,
           .columns = [](const Windows& ws,
                         double power) { return body_drift(ws, [&](auto& w) { return std::pow(w.t / 100, power); }); }},
          {.cause = "imu_drift",
           .formula = "accelerometer bias b (T - 25 C)/10 C, fixed to the body",
           .parameters = {"x_mps2_per_10c", "y_mps2_per_10c", "z_mps2_per_10c"},
           .floor = 0.015,
           .columns = [](const Windows& ws, double) {
             return body_drift(ws, [](auto& w) { return (w.temperature - 25) / 10; });
           }}};
}

std::vector<Form> variances() {
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
           .scales =
               [] {
                 std::vector<double> all(kMapOffsets);
                 for (std::size_t k = 0; k < kMapOffsets; ++k) all[k] = static_cast<double>(k);
                 return all;
               }(),
           .integer_scale = true,
           .floor = 0.12,
           .one_sided = true,
           .columns =
               [](const Windows& ws, double offset) {
                 Column column;
                 for (const Channel c : kVariances)
                   column.parts.push_back(
                       {c, values(ws, [&](auto& w) {
                          return w.ln_sigma_moved[static_cast<std::size_t>(offset)][static_cast<int>(c - kVarX)];
                        })});
                 return std::vector{column};
               }},
          {.cause = "heavy_tails",
           .formula = "ln kurtosis + K",
           .parameters = {"K_ln"},
           .constant = true,
           .floor = 0.15,
           .one_sided = true,
           .columns = [](const Windows& ws, double) { return std::vector{in(kTail, ws, [](auto&) { return 1.0; })}; }}};
}

Column one_rotor(Channel first, const Windows& ws, double rotor, bool contrast) {
  Column column;
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = (i == static_cast<std::size_t>(rotor) ? 1.0 : 0.0) - (contrast ? 0.25 : 0.0);
    if (x != 0) column.parts.push_back({static_cast<Channel>(first + i), std::vector<double>(ws.size(), x)});
  }
  return column;
}

const std::vector<double> kRotors = {0, 1, 2, 3};

std::vector<Form> rotors() {
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

}  // namespace

const std::vector<std::string>& cause_names() {
  static const std::vector<std::string> names = {"ground_thrust",
                                                 "ceiling",
                                                 "wall_attraction",
                                                 "recirculation",
                                                 "forward_speed",
                                                 "battery_sag",
                                                 "thrust_slope",
                                                 "payload",
                                                 "trim",
                                                 "draft",
                                                 "rotor_drag",
                                                 "actuator_lag",
                                                 "command_latency",
                                                 "imu_drift",
                                                 "vibration",
                                                 "map_offset",
                                                 "heavy_tails",
                                                 "propeller_damage",
                                                 "rotor_sensor_fault"};
  return names;
}

const std::vector<Form>& catalogue() {
  static const std::vector<Form> all = [] {
    std::vector<Form> forms;
    for (auto part : {near_surfaces(), vehicle(), pushes(), variances(), rotors()})
      forms.insert(forms.end(), part.begin(), part.end());
    return forms;
  }();
  return all;
}

std::optional<std::string> why_not_tested(const Form& form, const Observations& seen) {
  const auto need = [&](const char* what) -> std::optional<std::string> {
    return seen.has(what) ? std::nullopt : std::optional(seen.missing.at(what));
  };
  const std::string& c = form.cause;
  const auto any = [&](auto test) { return std::any_of(seen.windows.begin(), seen.windows.end(), test); };
  if (c == "wall_attraction" || c == "map_offset")
    if (auto why = need("map")) return why;
  if (c == "ceiling")
    if (auto why = need("ceiling")) return why;
  if (c == "ceiling" && !any([](auto& w) { return w.around.ceiling_gap < 1.5; }))
    return "no ceiling within 1.5 m of the flights";
  if (c == "wall_attraction" && !any([](auto& w) { return !w.around.walls.empty(); }))
    return "no wall within 3 m of the flights";
  if (c == "recirculation" && seen.has("map") && !any([](auto& w) { return std::isfinite(w.around.ceiling_gap); }))
    return "the map shows no closed room";
  if (c == "battery_sag") {
    if (auto why = need("battery")) return why;
    if (!seen.has("thrust")) return seen.missing.at("thrust");
  }
  if (form.parameters[0] == "x_mps2_per_10c")
    if (auto why = need("temperature")) return why;
  if (c == "trim" || c == "imu_drift" || c == "thrust_slope" || c == "actuator_lag")
    if (auto why = need("attitude")) return why;
  const bool off_centre = c == "payload" && form.integer_scale;
  if (off_centre)
    if (auto why = need("motors")) return why;
  if (c == "thrust_slope" || c == "actuator_lag" || (c == "payload" && !off_centre))
    if (auto why = need("thrust")) return why;
  if (c == "thrust_slope" || c == "actuator_lag" || c == "command_latency")
    if (auto why = need("setpoints")) return why;
  if (c == "vibration" || c == "rotor_sensor_fault" || (form.parameters.size() == 2 && c == "propeller_damage"))
    if (auto why = need("rpm")) return why;
  if (c == "propeller_damage")
    if (auto why = need("motors")) return why;
  if (seen.windows.empty()) return "no good window";
  for (const auto& column : form.columns(seen.windows, form.scales.front()))
    if (std::any_of(column.parts.begin(), column.parts.end(), [&](auto& p) { return seen.measured(p.channel); }))
      return std::nullopt;
  return "no window measures it";
}

std::vector<Regressor> regressors(const Observations& seen) {
  std::vector<Regressor> all = {{"z_m", false, [](const WindowRow& w) { return w.around.height; }},
                                {"x_m", false, [](const WindowRow& w) { return w.p_W.x(); }},
                                {"y_m", false, [](const WindowRow& w) { return w.p_W.y(); }},
                                {"speed_mps", false, [](const WindowRow& w) { return w.speed; }},
                                {"t_s", false, [](const WindowRow& w) { return w.t; }}};
  if (seen.has("map")) {
    all.push_back({"ceiling_gap_m", false, [](const WindowRow& w) { return std::min(w.around.ceiling_gap, 9.0); }});
    all.push_back({"wall_distance_m", false, [](const WindowRow& w) {
                     double least = 9;
                     for (const auto& [distance, direction] : w.around.walls) least = std::min(least, distance);
                     return least;
                   }});
  }
  if (seen.has("battery")) all.push_back({"battery_v", false, [](const WindowRow& w) { return w.voltage; }});
  if (seen.has("temperature"))
    all.push_back({"temperature_c", false, [](const WindowRow& w) { return w.temperature; }});
  if (seen.has("attitude")) all.push_back({"yaw_rad", true, [](const WindowRow& w) { return w.yaw; }});
  return all;
}

std::vector<Column> smooth_columns(const Regressor& along, const Windows& windows, const std::vector<Channel>& group) {
  std::vector<double> u = values(windows, along.value);
  if (!along.circular) {
    std::vector<double> sorted = u;
    std::sort(sorted.begin(), sorted.end());
    for (double& x : u) {
      const auto [low, high] = std::equal_range(sorted.begin(), sorted.end(), x);
      x = 0.5 * static_cast<double>((low - sorted.begin()) + (high - sorted.begin())) / static_cast<double>(u.size());
    }
  }
  std::vector<Column> columns;
  for (int k = 1; k <= 4; ++k) {
    std::vector<double> x;
    for (const double q : u) {
      const int turns = (k + 1) / 2;
      x.push_back(!along.circular ? std::cos(M_PI * k * q) : k % 2 ? std::cos(turns * q) : std::sin(turns * q));
    }
    // A push may point anywhere in the plane: x and y have coefficients of their own. ln variance moves as one.
    if (group.front() == kVarX) {
      columns.emplace_back();
      for (const Channel c : group) columns.back().parts.push_back({c, x});
    } else {
      for (const Channel c : group) columns.push_back({{{c, x}}});
    }
  }
  return columns;
}

std::vector<Column> companions(const Form& form, const Observations& seen) {
  const Windows& ws = seen.windows;
  if (form.cause == "battery_sag") return {missing_thrust(ws, [](auto&) { return 1.0; })};
  if (form.cause == "imu_drift") {
    return {level(ws, [](auto& w) -> Vec3 { return w.R_WB.col(0); }),
            level(ws, [](auto& w) -> Vec3 { return w.R_WB.col(1); }), in(kMeanZ, ws, [](auto&) { return 1.0; })};
  }
  return {};
}

std::vector<Column> offsets(const std::vector<Column>& columns, const Observations& seen) {
  std::array<bool, kChannels> used{};
  for (const auto& column : columns)
    for (const auto& part : column.parts) used[part.channel] = true;
  const Windows& ws = seen.windows;
  std::vector<Column> free;
  if (used[kMeanX] || used[kMeanY]) {
    free.push_back(level(ws, [](auto&) -> Vec3 { return Vec3::UnitX(); }));
    free.push_back(level(ws, [](auto&) -> Vec3 { return Vec3::UnitY(); }));
    if (seen.has("attitude"))
      for (int i = 0; i < 2; ++i) free.push_back(level(ws, [i](auto& w) -> Vec3 { return w.R_WB.col(i); }));
  }
  if (used[kMeanZ]) free.push_back(in(kMeanZ, ws, [](auto&) { return 1.0; }));
  if (used[kVarX] || used[kVarY] || used[kVarZ]) {
    for (const Channel c : kVariances) free.push_back(in(c, ws, [](auto&) { return 1.0; }));
    Column noise;
    for (const Channel c : kVariances)
      noise.parts.push_back({c, values(ws, [&](auto& w) { return 0.005 / w.sigma[static_cast<int>(c - kVarX)]; })});
    free.push_back(std::move(noise));
  }
  return free;
}

}  // namespace backwash::study::discrepancy

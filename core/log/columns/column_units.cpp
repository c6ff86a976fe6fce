// SPDX-License-Identifier: BSD-3-Clause
// Which columns a table may hold, and the units that each may come in.
#include <algorithm>
#include <array>
#include <numbers>
#include <set>
#include <span>

#include "core/log/columns/import_columns.hpp"
#include "core/types/angle.hpp"
#include "core/types/geometry.hpp"

namespace backwash::log {
namespace {

struct Unit {
  const char* name;
  double factor;
};
constexpr double kFoot = 0.3048;  // m
constexpr Unit kTime[] = {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}};
constexpr Unit kLength[] = {{"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"ft", kFoot}, {"in", kFoot / 12}};
constexpr Unit kSpeed[] = {{"m/s", 1},        {"cm/s", 1e-2},        {"mm/s", 1e-3},
                           {"km/h", 1 / 3.6}, {"kn", 1852 / 3600.0}, {"ft/s", kFoot}};
constexpr Unit kAcceleration[] = {{"m/s2", 1}, {"g", kGravity}, {"cm/s2", 1e-2}, {"mm/s2", 1e-3}, {"ft/s2", kFoot}};
constexpr Unit kAngle[] = {{"rad", 1}, {"deg", kDegree}};
constexpr Unit kVoltage[] = {{"V", 1}, {"mV", 1e-3}};
constexpr Unit kTemperature[] = {{"degC", 1}};
constexpr Unit kRate[] = {{"1/min", 1}, {"rad/s", 30 / std::numbers::pi}, {"1/s", 60}};
constexpr Unit kShare[] = {{"1", 1}, {"percent", 1e-2}, {"u16", 1 / 65535.0}};
constexpr Unit kNumber[] = {{"1", 1}};

struct Kind {
  std::vector<std::string> columns;
  std::span<const Unit> units;
};
const std::array<Kind, 11>& kinds() {
  static const std::array<Kind, 11> all{
      {{{"t_s"}, kTime},
       {{"x_m", "y_m", "z_m", "cmd_x_m", "cmd_y_m", "cmd_z_m", "surface_z_m", "stood_z_m"}, kLength},
       {{"vx_mps", "vy_mps", "vz_mps", "cmd_vx_mps", "cmd_vy_mps", "cmd_vz_mps"}, kSpeed},
       {{"ax_mps2", "ay_mps2", "az_mps2", "cmd_ax_mps2", "cmd_ay_mps2", "cmd_az_mps2"}, kAcceleration},
       {{"specific_force_x", "specific_force_y", "specific_force_z"}, kAcceleration},
       {{"roll", "pitch", "yaw"}, kAngle},
       {{"battery_v"}, kVoltage},
       {{"temperature_c"}, kTemperature},
       {{"rpm1", "rpm2", "rpm3", "rpm4"}, kRate},
       {{"thrust", "motor1", "motor2", "motor3", "motor4"}, kShare},
       {{"qw", "qx", "qy", "qz", "segment", "ceiling", "day"}, kNumber}}};
  return all;
}

std::span<const Unit> kind_of(const std::string& column) {
  for (const auto& kind : kinds())
    if (std::ranges::count(kind.columns, column)) return kind.units;
  return {};
}

}  // namespace

std::optional<double> unit_factor(const std::string& column, const std::string& unit) {
  const auto units = kind_of(column);
  if (unit.empty() && !units.empty()) return 1;
  for (const Unit& u : units)
    if (unit == u.name) return u.factor;
  return std::nullopt;
}

std::vector<std::string> units_of(const std::string& column) {
  std::vector<std::string> names;
  for (const Unit& u : kind_of(column)) names.emplace_back(u.name);
  return names;
}

std::vector<std::string> all_units() {
  std::set<std::string> names;
  for (const auto& kind : kinds())
    for (const Unit& u : kind.units) names.insert(u.name);
  return {names.begin(), names.end()};
}

std::vector<std::string> mappable_columns() {
  std::vector<std::string> names;
  for (const auto& kind : kinds()) names.insert(names.end(), kind.columns.begin(), kind.columns.end());
  return names;
}

}  // namespace backwash::log

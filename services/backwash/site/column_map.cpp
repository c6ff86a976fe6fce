// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/site/column_map.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>
#include <sstream>
#include <vector>

#include "core/config/strict_table.hpp"
#include "core/log/columns/median.hpp"

namespace backwash::services {
namespace {

using log::ColumnMap;

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// "NAME [UNIT]": the unit may be missing.
ColumnMap::Source source_of(const std::string& text) {
  const auto open = text.rfind(" [");
  if (open == std::string::npos || !text.ends_with(']')) return {text, ""};
  return {text.substr(0, open), text.substr(open + 2, text.size() - open - 3)};
}

std::string list(const std::vector<std::string>& names) {
  std::string all;
  for (const auto& name : names) all += (all.empty() ? "" : ", ") + name;
  return all;
}

/// What people call our columns; % stands for x, y, z, and # for 1 … 4. The first that a table has is taken.
struct Known {
  const char* ours;
  std::vector<const char*> theirs;
};
const std::vector<Known>& known() {
  static const std::vector<Known> all{
      {"t_s",
       {"t_s", "t", "time", "timestamp", "time_s", "timestamp_us", "time_us", "stamp", "time_ms", "timestamp_ns"}},
      {"%_m", {"%_m", "p%", "pos_%", "position_%", "position.%", "%", "stateestimate.%", "est_stateestimate_%", "pn%"}},
      {"v%_mps", {"v%_mps", "v%", "vel_%", "velocity_%", "velocity.%", "stateestimate.v%", "est_stateestimate_v%"}},
      {"acceleration_%", {"a%_mps2", "a%", "acc_%", "accel_%", "acc.%", "imu_acc_%", "acceleration_%", "a%_g", "acc%"}},
      {"q%", {"q%", "quat_%", "orientation_%", "orientation.%", "q_%", "stateestimate.q%"}},
      {"roll", {"roll", "roll_deg", "roll_rad", "stabilizer.roll"}},
      {"pitch", {"pitch", "pitch_deg", "pitch_rad", "stabilizer.pitch"}},
      {"yaw", {"yaw", "yaw_deg", "yaw_rad", "stabilizer.yaw"}},
      {"cmd_%_m", {"cmd_%_m", "sp_%", "setpoint_%", "des_%", "ref_%", "ctrltarget.%", "sp_ctrltarget_%"}},
      {"thrust", {"thrust", "cmd_thrust", "controller.cmd_thrust", "pid_controller_cmd_thrust"}},
      {"motor#", {"motor#", "m#", "motor_m#", "motor.m#", "motor_motor_m#", "pwm#"}},
      {"rpm#", {"rpm#", "rpm_#", "rotor#_rpm"}},
      {"battery_v", {"battery_v", "vbat", "battery_mv", "voltage", "pm.vbat", "pwr_pm_vbat"}}};
  return all;
}

/// The name for one axis or rotor.
std::string filled(std::string pattern, char with) {
  std::ranges::replace(pattern, '%', with);
  std::ranges::replace(pattern, '#', with);
  return pattern;
}

std::optional<std::string> called(const std::vector<std::string>& header, const std::vector<const char*>& names,
                                  char with) {
  for (const char* name : names)
    for (const auto& column : header)
      if (lower(column) == filled(name, with)) return column;
  return std::nullopt;
}

/// Every column of ours that some column of theirs is called like; acceleration_x … stands for either kind.
std::map<std::string, std::string> guessed(const std::vector<std::string>& header) {
  std::map<std::string, std::string> found;
  for (const auto& [ours, theirs] : known()) {
    const std::string name = ours;
    const bool quaternion = name == "q%";
    const std::string over = quaternion ? "wxyz" : name.find('#') != std::string::npos ? "1234" : "xyz";
    if (filled(name, 'x') == name) {
      if (const auto column = called(header, theirs, 'x')) found[name] = *column;
      continue;
    }
    std::map<std::string, std::string> whole;
    for (const char c : over)
      if (const auto column = called(header, theirs, c)) whole[filled(name, c)] = *column;
    if (whole.size() == over.size()) found.insert(whole.begin(), whole.end());
  }
  if (found.contains("qw"))
    for (const char* angle : {"roll", "pitch", "yaw"}) found.erase(angle);
  if (!found.contains("roll") || !found.contains("pitch") || !found.contains("yaw"))
    for (const char* angle : {"roll", "pitch", "yaw"}) found.erase(angle);
  return found;
}

/// The unit of a column that no frame decides: from how often its numbers come, or how large they are.
std::string unit_of(const std::string& ours, const log::FlightLog& table, const std::string& theirs) {
  if (ours == "t_s") {
    std::vector<double> steps;
    for (std::size_t i = 1; i < table.t_s.size(); ++i) steps.push_back(table.t_s[i] - table.t_s[i - 1]);
    if (steps.empty()) return "s";
    const double step = log::median(std::move(steps));
    return step < 0.1 ? "s" : step < 100 ? "ms" : step < 1e5 ? "us" : "ns";
  }
  double most = 0;
  for (const double value : table.column(theirs))
    if (std::isfinite(value)) most = std::max(most, std::abs(value));
  if (ours == "thrust" || ours.starts_with("motor")) return most <= 1.2 ? "1" : most <= 100 ? "percent" : "u16";
  if (ours == "battery_v") return most > 100 ? "mV" : "V";
  if (ours == "roll" || ours == "pitch" || ours == "yaw")
    return most > 6.4 || lower(theirs).ends_with("deg") ? "deg" : "rad";
  return "";
}

std::string written(const ColumnMap& map, const std::vector<std::string>& doubts) {
  std::string text = "# A guess from the names of the columns";
  text += doubts.empty() ? ", and nothing in the numbers contradicts it.\n" : ". The numbers contradict it:\n";
  for (const auto& doubt : doubts) text += "#   " + doubt + "\n";
  text += std::string("[frame]\nworld = \"") + (map.ned ? "ned" : "enu") + "\"\nbody = \"" + (map.frd ? "frd" : "flu") +
          "\"\n\n[columns]\n";
  for (const auto& [ours, theirs] : map.columns) {
    toml::table one;
    one.insert(ours, theirs.name + (theirs.unit.empty() ? "" : " [" + theirs.unit + "]"));
    std::ostringstream line;
    line << one;
    text += line.str() + "\n";
  }
  return text;
}

}  // namespace

tl::expected<ColumnMap, config::ConfigError> read_column_map(const std::string& path) {
  auto table = config::StrictTable::open(path, "");
  if (!table) return tl::make_unexpected(table.error());
  std::vector<std::string> paths;
  for (const auto& name : log::mappable_columns()) paths.push_back("columns." + name);
  std::vector<config::Key> allowed;
  for (const std::string_view key : {"frame.world", "frame.body"}) allowed.push_back(config::read_elsewhere(key));
  for (const auto& column : paths) allowed.push_back(config::read_elsewhere(column));
  if (auto read = table->read(allowed); !read) return tl::make_unexpected(read.error());
  ColumnMap map;
  const auto one_of = [&](const char* key, const char* usual,
                          const char* other) -> tl::expected<bool, config::ConfigError> {
    if (!table->has(key)) return false;
    const auto text = table->text(key);
    if (!text) return tl::make_unexpected(text.error());
    if (*text != usual && *text != other)
      return tl::make_unexpected(table->error(key, "is '" + std::string(usual) + "' or '" + other + "'"));
    return *text == other;
  };
  const auto ned = one_of("frame.world", "enu", "ned"), frd = one_of("frame.body", "flu", "frd");
  if (!ned) return tl::make_unexpected(ned.error());
  if (!frd) return tl::make_unexpected(frd.error());
  map.ned = *ned;
  map.frd = *frd;
  for (const auto& name : log::mappable_columns()) {
    const std::string key = "columns." + name;
    if (!table->has(key)) continue;
    const auto text = table->text(key);
    if (!text) return tl::make_unexpected(text.error());
    const auto source = source_of(*text);
    if (!log::unit_factor(name, source.unit))
      return tl::make_unexpected(table->error(key, "its unit is one of " + list(log::units_of(name))));
    map.columns.emplace(name, source);
  }
  for (const char* needed : {"t_s", "x_m", "y_m", "z_m"})
    if (!map.columns.contains(needed))
      return tl::make_unexpected(table->error("columns." + std::string(needed), "a flight needs time and position"));
  for (const auto& family : log::column_families())
    for (const auto& name : family)
      if (!map.columns.contains(name) &&
          std::ranges::any_of(family, [&](const auto& n) { return map.columns.contains(n); }))
        return tl::make_unexpected(table->error("columns." + name, "give all of " + list(family) + " or none"));
  for (const auto& [one, other] : {std::pair{"qw", "roll"}, {"ax_mps2", "specific_force_x"}})
    if (map.columns.contains(one) && map.columns.contains(other))
      return tl::make_unexpected(table->error("columns." + std::string(other), "give this or " + std::string(one)));
  return map;
}

tl::expected<std::string, log::LogError> proposed_column_map(const std::string& table) {
  const auto header = log::csv_names(table);
  if (!header) return tl::make_unexpected(header.error());
  auto found = guessed(*header);
  const auto lacks = [&](const char* what, const std::string& names) {
    return tl::make_unexpected(log::LogError{log::LogError::Kind::bad_data,
                                             table + ":1: no column is called like " + what + "; it has " + names});
  };
  if (!found.contains("t_s")) return lacks("a time", list(*header));
  if (!found.contains("x_m")) return lacks("a position", list(*header));
  std::set<std::string> unread(header->begin(), header->end());
  for (const auto& [ours, theirs] : found) unread.erase(theirs);
  const auto raw = log::read_csv(table, found.at("t_s"), unread, true);
  if (!raw) return tl::make_unexpected(raw.error());

  ColumnMap base;
  for (const auto& [ours, theirs] : found)
    if (!ours.starts_with("acceleration_")) base.columns[ours] = {theirs, unit_of(ours, *raw, theirs)};
  const bool turned = found.contains("qw") || found.contains("roll");
  std::vector<std::array<std::string, 2>> kinds{{"", ""}};  // of acceleration: ours, unit
  if (found.contains("acceleration_x")) {
    kinds = {{"a%_mps2", "m/s2"}, {"a%_mps2", "g"}};
    if (turned) kinds.insert(kinds.begin(), {{"specific_force_%", "m/s2"}, {"specific_force_%", "g"}});
  }
  ColumnMap best;
  std::optional<std::vector<std::string>> doubts;
  for (const auto& [kind, unit] : kinds)
    for (const bool ned : {false, true})
      for (const bool frd : {false, true}) {
        ColumnMap map = base;
        map.ned = ned;
        map.frd = frd;
        for (const char c : std::string(kind.empty() ? "" : "xyz"))
          map.columns[filled(kind, c)] = {found.at(std::string("acceleration_") + c), unit};
        const auto flight = log::import_unchecked(table, map);
        std::vector<std::string> wrong;
        if (!flight) wrong.push_back(flight.error().message);
        if (flight)
          for (const auto& doubt : log::contradictions(*flight)) wrong.push_back(doubt.words);
        if (!doubts || wrong.size() < doubts->size()) {
          best = map;
          doubts = wrong;
        }
      }
  return written(best, *doubts);
}

}  // namespace backwash::services

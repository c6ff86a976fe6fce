// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/site/column_map.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>
#include <span>
#include <sstream>
#include <tuple>
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
       {"t_s", "t", "time", "timestamp", "time_s", "timestamp_us", "time_us", "stamp", "time_ms", "timestamp_ns",
        "frame/rate"}},
      {"%_m",
       {"%_m", "p%", "pos_%", "position_%", "position.%", "%", "stateestimate.%", "est_stateestimate_%", "pn%", "t%",
        "position %", "%_pos", "pose.position.%", "pose.pose.position.%"}},
      {"v%_mps",
       {"v%_mps", "v%", "vel_%", "velocity_%", "velocity.%", "stateestimate.v%", "est_stateestimate_v%", "velocity %"}},
      {"acceleration_%", {"a%_mps2", "a%", "acc_%", "accel_%", "acc.%", "imu_acc_%", "acceleration_%", "a%_g", "acc%"}},
      {"q%",
       {"q%", "quat_%", "orientation_%", "orientation.%", "q_%", "stateestimate.q%", "rotation %", "pose.orientation.%",
        "pose.pose.orientation.%"}},
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

/// The words of a name, lower case; "Position X" and "p_RS_R_x" have the quantity first and the axis last.
std::vector<std::string> words(const std::string& name) {
  std::vector<std::string> all(1);
  for (const char c : lower(name)) {
    if (std::isalnum(static_cast<unsigned char>(c))) {
      all.back() += c;
    } else if (!all.back().empty()) {
      all.emplace_back();
    }
  }
  if (all.back().empty()) all.pop_back();
  return all;
}

/// A column that is called so; else one whose name ends so, after an object's; else one with names of frames between
/// the quantity and the axis. The first of each; none whose name is there twice.
std::optional<std::string> called(const log::ForeignTable& table, const std::vector<const char*>& names, char with) {
  using Fits = bool (*)(const std::string& column, const std::string& name);
  constexpr Fits kFits[] = {[](const std::string& column, const std::string& name) {
                              return lower(column) == name || lower(column) == "#" + name;
                            },
                            [](const std::string& column, const std::string& name) {
                              const auto have = words(column), want = words(name);
                              return !name.empty() && name.size() > 1 && have.size() > want.size() &&
                                     std::ranges::equal(std::span(have).last(want.size()), want);
                            },
                            [](const std::string& column, const std::string& name) {
                              const auto have = words(column);
                              return have.size() > 2 && have.front() + have.back() == name;
                            }};
  for (const Fits fits : kFits)
    for (const char* name : names)
      for (const auto& column : table.columns)
        if (!table.find(column.name + " (2)") && fits(column.name, filled(name, with))) return column.name;
  return std::nullopt;
}

/// Every column of ours that some column of theirs is called like; acceleration_x … stands for either kind.
std::map<std::string, std::string> guessed(const log::ForeignTable& header) {
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

/// The unit of a column that no frame decides: as the table states it, or from how often its numbers come, or how large
/// they are.
std::string unit_of(const std::string& ours, const log::ForeignTable::Column& theirs) {
  if (!theirs.unit.empty() && log::unit_factor(ours, theirs.unit)) return theirs.unit;
  if (ours == "t_s") {
    std::vector<double> steps;
    for (std::size_t i = 1; i < theirs.values.size(); ++i)
      if (const double step = theirs.values[i] - theirs.values[i - 1]; step > 0) steps.push_back(step);
    if (steps.empty()) return "s";
    const double step = log::median(std::move(steps));
    return step < 0.1 ? "s" : step < 100 ? "ms" : step < 1e5 ? "us" : "ns";
  }
  double most = 0;
  for (const double value : theirs.values)
    if (std::isfinite(value)) most = std::max(most, std::abs(value));
  if (ours == "thrust" || ours.starts_with("motor")) return most <= 1.2 ? "1" : most <= 100 ? "percent" : "u16";
  if (ours == "battery_v") return most > 100 ? "mV" : "V";
  if (ours == "roll" || ours == "pitch" || ours == "yaw")
    return most > 6.4 || lower(theirs.name).ends_with("deg") ? "deg" : "rad";
  return "";
}

std::string written(const ColumnMap& map, const std::vector<std::string>& doubts, bool told) {
  std::string text = "# A guess from the names of the columns";
  text += doubts.empty() ? ", and nothing in the numbers contradicts it.\n" : ". The numbers contradict it:\n";
  for (const auto& doubt : doubts) text += "#   " + doubt + "\n";
  if (!told) text += "# Which axes are up the flight does not tell: [frame] is a guess; check it.\n";
  text += "[frame]\n";
  if (map.world) text += "world = \"" + log::called(*map.world, log::named_worlds()) + "\"\n";
  if (map.body) text += "body = \"" + log::called(*map.body, log::named_bodies()) + "\"\n";
  text += "\n[columns]\n";
  for (const auto& [ours, theirs] : map.columns) {
    toml::table one;
    one.insert(ours, theirs.name + (theirs.unit.empty() ? "" : " [" + theirs.unit + "]"));
    std::ostringstream line;
    line << one;
    text += line.str() + "\n";
  }
  return text;
}

/// What a table without a header holds, or one that the user names: his names, "-" for what is left out; else those of
/// the trajectories of TUM, which eight columns with a unit quaternion at the end are.
tl::expected<std::vector<std::string>, std::string> titles_of(const log::ForeignTable& table,
                                                              const std::string& names) {
  std::vector<std::string> titles;
  for (const auto& column : table.columns) titles.push_back(column.name);
  if (!names.empty()) {
    std::vector<std::string> given(1);
    for (const char c : names) {
      if (c == ',') given.emplace_back();
      if (c != ',' && c != ' ') given.back() += c;
    }
    if (given.size() != titles.size())
      return tl::make_unexpected("--columns names " + std::to_string(given.size()) + " columns, the table has " +
                                 std::to_string(titles.size()) + "; name each, - for one to leave out");
    return given;
  }
  constexpr std::array kTum{"t", "tx", "ty", "tz", "qx", "qy", "qz", "qw"};
  if (table.named || titles.size() != kTum.size()) return titles;
  for (std::size_t row = 0; row < table.columns[0].values.size(); ++row) {
    double square = 0;
    for (std::size_t c = 4; c < kTum.size(); ++c) square += std::pow(table.columns[c].values[row], 2);
    if (std::abs(square - 1) > 0.02) return titles;
  }
  return std::vector<std::string>(kTum.begin(), kTum.end());
}

/// The turns of world and body to try: what the numbers say; else the named ones, or none of a world that only its user
/// knows.
std::vector<std::pair<std::optional<log::Turn>, std::optional<log::Turn>>> turns_for(const log::FlightLog& theirs) {
  if (const auto up = log::up_axes(theirs)) return {{log::upright_world(up->world), log::upright_body(up->body)}};
  if (log::flat_height(theirs)) return {{std::nullopt, std::nullopt}};
  std::vector<std::pair<std::optional<log::Turn>, std::optional<log::Turn>>> all;
  for (const auto& world : log::named_worlds()) {
    if (const auto body = log::body_up(theirs, world.turn.transpose() * Vec3::UnitZ())) {
      all.emplace_back(world.turn, log::upright_body(*body));
      continue;
    }
    for (const auto& body : log::named_bodies()) all.emplace_back(world.turn, body.turn);
  }
  return all;
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
  for (const auto& [key, into, names] :
       {std::tuple{"frame.world", &map.world, &log::named_worlds()}, {"frame.body", &map.body, &log::named_bodies()}}) {
    if (!table->has(key)) continue;
    const auto text = table->text(key);
    if (!text) return tl::make_unexpected(text.error());
    const auto known = std::ranges::find(*names, *text, [](const auto& n) { return std::string(n.name); });
    *into = known != names->end() ? std::optional(known->turn) : log::turn_of(*text);
    if (!*into)
      return tl::make_unexpected(
          table->error(key, std::string("is '") + names->front().name + "', '" + names->back().name +
                                "', or our x, y and z in theirs, right-handed, as 'x, -z, y' where y is up"));
  }
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

tl::expected<std::string, log::LogError> proposed_column_map(const std::string& path, const std::string& names) {
  auto table = log::read_foreign_table(path);
  if (!table) return tl::make_unexpected(table.error());
  const auto bad = [&](const std::string& what) {
    return tl::make_unexpected(log::LogError{log::LogError::Kind::bad_data, path + ":1: " + what});
  };
  const auto titles = titles_of(*table, names);
  if (!titles) return bad(titles.error());
  log::ForeignTable titled = *table;
  for (std::size_t i = 0; i < titles->size(); ++i) titled.columns[i].name = (*titles)[i];
  auto found = guessed(titled);
  for (const auto& [ours, what] : {std::pair{"t_s", "a time"}, {"x_m", "a position"}})
    if (!found.contains(ours))
      return bad(std::string("no column is called like ") + what + "; it has " + table->names() +
                 ": name them by --columns, a name each in their order, as t,x,y,z,- (- is left out)");
  for (auto& [ours, title] : found)  // as the file has it
    title = table->columns[static_cast<std::size_t>(titled.find(title) - titled.columns.data())].name;

  ColumnMap base;
  for (const auto& [ours, theirs] : found)
    if (!ours.starts_with("acceleration_")) base.columns[ours] = {theirs, unit_of(ours, *table->find(theirs))};
  const bool turned = found.contains("qw") || found.contains("roll");
  std::vector<std::array<std::string, 2>> kinds{{"", ""}};  // of acceleration: ours, unit
  if (found.contains("acceleration_x")) {
    kinds = {{"a%_mps2", "m/s2"}, {"a%_mps2", "g"}};
    if (turned) kinds.insert(kinds.begin(), {{"specific_force_%", "m/s2"}, {"specific_force_%", "g"}});
  }
  ColumnMap best;
  std::optional<std::vector<std::string>> doubts;
  bool told = false;
  for (const auto& [kind, unit] : kinds) {
    ColumnMap map = base;
    for (const char c : std::string(kind.empty() ? "" : "xyz"))
      map.columns[filled(kind, c)] = {found.at(std::string("acceleration_") + c), unit};
    const auto theirs = log::in_their_axes(*table, path, map);
    if (!theirs) {
      if (!doubts) best = map, doubts = {theirs.error().message};
      continue;
    }
    told = told || log::up_axes(*theirs);
    for (const auto& [world, body] : turns_for(*theirs)) {
      map.world = world;
      map.body = body;
      const auto flight = log::in_our_axes(*theirs, map);
      std::vector<std::string> wrong;
      if (!flight) wrong.push_back(flight.error());
      if (flight)
        for (const auto& doubt : log::contradictions(*flight)) wrong.push_back(doubt.words);
      if (!world) wrong.push_back(log::flat_height(*theirs)->first + ": say which axis is up by frame.world");
      if (!doubts || wrong.size() < doubts->size()) {
        best = map;
        doubts = wrong;
      }
    }
  }
  return written(best, *doubts, told);
}

}  // namespace backwash::services

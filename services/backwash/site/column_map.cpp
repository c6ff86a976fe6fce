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
#include "core/log/columns/table_rows.hpp"

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
      {"t_s", {"t", "time", "timestamp", "stamp", "frame/rate"}},
      {"%_m",
       {"p%", "pos_%", "position_%", "position.%", "%", "stateestimate.%", "est_stateestimate_%", "pn%", "t%",
        "position %", "%_pos", "pose.position.%", "pose.pose.position.%"}},
      {"v%_mps", {"v%", "vel_%", "velocity_%", "velocity.%", "stateestimate.v%", "est_stateestimate_v%", "velocity %"}},
      {"acceleration_%", {"a%", "acc_%", "accel_%", "acc.%", "imu_acc_%", "acceleration_%", "acc%"}},
      {"q%",
       {"q%", "quat_%", "orientation_%", "orientation.%", "q_%", "stateestimate.q%", "rotation %", "pose.orientation.%",
        "pose.pose.orientation.%"}},
      {"roll", {"roll", "stabilizer.roll"}},
      {"pitch", {"pitch", "stabilizer.pitch"}},
      {"yaw", {"yaw", "stabilizer.yaw"}},
      {"cmd_%_m", {"cmd_%", "sp_%", "setpoint_%", "des_%", "ref_%", "ctrltarget.%", "sp_ctrltarget_%"}},
      {"thrust", {"thrust", "cmd_thrust", "controller.cmd_thrust", "pid_controller_cmd_thrust"}},
      {"motor#", {"motor#", "m#", "motor_m#", "motor.m#", "motor_motor_m#", "pwm#"}},
      {"rpm#", {"rpm#", "rpm_#", "rotor#"}},
      {"battery_v", {"battery_v", "vbat", "voltage", "pm.vbat", "pwr_pm_vbat"}}};
  return all;
}

/// The name for one axis or rotor.
std::string filled(std::string pattern, char with) {
  std::ranges::replace(pattern, '%', with);
  std::ranges::replace(pattern, '#', with);
  return pattern;
}

/// The words of a name but for its unit, lower case; "Position X" and "p_RS_R_x" have the quantity first and the axis
/// last.
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
  if (all.size() > 1 && !log::unit_in_name(name).empty()) all.pop_back();
  return all;
}

/// A column that is called so, whatever unit its name ends with; else one whose name ends so, after an object's; else
/// one with names of frames between the quantity and the axis; else the axis after the name of the only object. The
/// first of each; none whose name is there twice.
std::optional<std::string> called(const log::ForeignTable& table, const std::vector<const char*>& names, char with) {
  using Fits = bool (*)(const std::vector<std::string>& column, const std::vector<std::string>& name);
  constexpr Fits kFits[] = {
      [](const auto& have, const auto& want) { return have == want; },
      [](const auto& have, const auto& want) {
        return (want.size() > 1 || want[0].size() > 1) && have.size() > want.size() &&
               std::ranges::equal(std::span(have).last(want.size()), want);
      },
      [](const auto& have, const auto& want) {
        return want.size() == 1 && have.size() > 2 && have.front() + have.back() == want[0];
      },
      [](const auto& have, const auto& want) { return want.size() == 1 && have.size() > 1 && have.back() == want[0]; }};
  for (const Fits fits : kFits) {
    std::vector<std::string> found;
    for (const char* name : names)
      for (const auto& column : table.columns) {
        const auto have = words(column.name);
        if (!have.empty() && !table.find(column.name + " (2)") && fits(have, words(filled(name, with))))
          found.push_back(column.name);
      }
    if (!found.empty() && (fits != std::end(kFits)[-1] || found.size() == 1)) return found.front();
  }
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
  if (const auto dated = std::ranges::find_if(header.columns, &log::ForeignTable::Column::dates);
      dated != header.columns.end())
    found["t_s"] = dated->name;
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
    if (theirs.dates) return "s";
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
  if (ours == "roll" || ours == "pitch" || ours == "yaw") return most > 6.4 ? "deg" : "rad";
  return "";
}

std::string written(const ColumnMap& map, const std::vector<std::string>& doubts, bool bare) {
  std::string text = "# A guess from the names of the columns";
  text += doubts.empty() ? ", and nothing in the numbers contradicts it.\n" : ". Import refuses it as it stands:\n";
  for (const auto& doubt : doubts) text += "#   " + doubt + "\n";
  if (bare)
    text += "# Without a header the attitude is taken as TUM's, scalar last; else: --columns t,x,y,z,qw,qx,qy,qz\n";
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

/// Whether four columns in a row, from `first` on, are unit quaternions.
bool unit_from(const log::ForeignTable& table, std::size_t first) {
  for (std::size_t row = 0; row < table.columns[0].values.size(); ++row) {
    double square = 0;
    for (std::size_t c = first; c < first + 4; ++c) square += std::pow(table.columns[c].values[row], 2);
    if (std::abs(square - 1) > 0.02) return false;
  }
  return true;
}

/// The columns of the trajectories of TUM, which eight without a header are that end with a unit quaternion.
constexpr std::array kTum{"t", "tx", "ty", "tz", "qx", "qy", "qz", "qw"};
bool is_tum(const log::ForeignTable& table) {
  return !table.named && table.columns.size() == kTum.size() && unit_from(table, 4);
}

/// What a table without a header holds, or one that the user names: his names, "-" for what is left out; else TUM's.
tl::expected<std::vector<std::string>, std::string> titles_of(const log::ForeignTable& table,
                                                              const std::string& names) {
  constexpr std::size_t kKitti = 12;
  std::vector<std::string> titles, given(1);
  for (const auto& column : table.columns) titles.push_back(column.name);
  for (const char c : names) {
    if (c == ',') given.emplace_back();
    if (c != ',' && c != ' ') given.back() += c;
  }
  if (!names.empty() && given.size() == titles.size()) return given;
  if (!names.empty())
    return tl::make_unexpected("--columns names " + std::to_string(given.size()) + " columns, the table has " +
                               std::to_string(titles.size()) + "; name each, - for one to leave out");
  if (!table.named && titles.size() == kKitti)
    return tl::make_unexpected(
        "twelve columns without a header are poses as KITTI has them, without times: paste -d' ' times.txt FILE > "
        "flight.txt, and name its columns by --columns t,-,-,-,x,-,-,-,y,-,-,-,z");
  return is_tum(table) ? std::vector<std::string>(kTum.begin(), kTum.end()) : titles;
}

}  // namespace

tl::expected<ColumnMap, config::ConfigError> read_column_map(const std::string& path) {
  auto table = config::StrictTable::open(path, "");
  if (!table) return tl::make_unexpected(table.error());
  std::vector<std::string> paths;
  for (const auto& name : log::mappable_columns()) paths.push_back("columns." + name);
  std::vector<config::Key> allowed;
  for (const std::string_view key : {"frame.world", "frame.body", "frame.attitude"})
    allowed.push_back(config::read_elsewhere(key));
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
  if (table->has("frame.attitude")) {
    const auto text = table->text("frame.attitude");
    if (!text) return tl::make_unexpected(text.error());
    map.world_to_body = *text == "world to body";
    if (!map.world_to_body && *text != "body to world")
      return tl::make_unexpected(table->error("frame.attitude", "is 'body to world' or 'world to body'"));
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
  const bool bare = names.empty() && is_tum(*table);
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
    const std::string stated = table->find(found.at("acceleration_x"))->unit;
    const bool known = log::unit_factor("ax_mps2", stated) && !stated.empty();
    kinds.clear();
    for (const std::string kind : {"specific_force_%", "a%_mps2"})
      for (const std::string unit : {"m/s2", "g"})
        if ((turned || kind != "specific_force_%") && (!known || unit == "g"))
          kinds.push_back({kind, known ? stated : unit});
  }
  ColumnMap best;
  std::optional<std::vector<std::string>> doubts;
  for (const auto& [kind, unit] : kinds) {
    ColumnMap map = base;
    for (const char c : std::string(kind.empty() ? "" : "xyz"))
      map.columns[filled(kind, c)] = {found.at(std::string("acceleration_") + c), unit};
    const auto theirs = log::in_their_axes(*table, path, map);
    std::vector<std::string> wrong;
    if (theirs) {
      const auto readings = log::axes_readings(*theirs);
      if (readings.size() == 1 && readings.front().keys.empty()) {
        map.world = log::upright_world(readings.front().up.world);
        map.body = log::upright_body(readings.front().up.body);
      }
      wrong.push_back(log::wrong_axes(*theirs, map));
    } else {
      wrong.push_back(theirs.error().message);
    }
    if (theirs) {
      const auto flight = log::in_our_axes(*theirs, map);
      if (!flight) wrong.push_back(flight.error());
      if (flight)
        for (const auto& doubt : log::contradictions(*flight)) wrong.push_back(doubt.words);
    }
    std::erase(wrong, "");
    if (doubts && wrong.size() >= doubts->size()) continue;
    best = map;
    doubts = wrong;
  }
  return written(best, *doubts, bare);
}

}  // namespace backwash::services

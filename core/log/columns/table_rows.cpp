// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/table_rows.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/log/columns/log_columns.hpp"
#include "core/types/formatted.hpp"

namespace backwash::log {
namespace {

constexpr std::array kPosition{"x_m", "y_m", "z_m"}, kAngles{"roll", "pitch", "yaw"};
constexpr std::array kQuaternion{"qw", "qx", "qy", "qz"};
constexpr double kLeap = 5;  // m/s to a place of zeros: no craft came by there

/// A column in our units; of stamps, what they are after the first: of nanoseconds since 1970 little else is left.
std::vector<double> in_our_units(const ForeignTable& table, const ColumnMap& map, const std::string& ours) {
  const auto& source = map.columns.at(ours);
  const auto& theirs = *table.find(source.name);
  // A unit that the table states is its own unless the map knows better.
  const auto stated = source.unit.empty() ? unit_factor(ours, theirs.unit) : unit_factor(ours, source.unit);
  std::vector<double> values = theirs.values;
  const auto first = std::ranges::find_if(values, [](double v) { return !std::isnan(v); });
  const double from = ours == "t_s" && first != values.end() ? *first : 0;
  for (double& v : values) v = (v - from) * stated.value_or(1);
  return values;
}

using Columns = std::map<std::string, std::vector<double>>;

template <std::size_t n>
bool zeros(const Columns& columns, const std::array<const char*, n>& names, std::size_t row) {
  return std::ranges::all_of(names, [&](const char* name) { return columns.at(name)[row] == 0; });
}

/// Rows of a body that was lost: an attitude of zeros; of positions alone, zeros that lie a leap beside the row before
/// or after them.
std::vector<bool> lost(const Columns& columns, const std::vector<double>& t_s) {
  std::vector<bool> all(t_s.size(), false);
  if (columns.contains("qw")) {
    for (std::size_t row = 0; row < all.size(); ++row) all[row] = zeros(columns, kQuaternion, row);
    return all;
  }
  const auto leaps = [&](std::size_t row, std::size_t zero) {
    double square = 0;
    for (const char* name : kPosition) square += std::pow(columns.at(name)[row], 2);
    return std::sqrt(square) > kLeap * std::abs(t_s[row] - t_s[zero]);
  };
  for (std::size_t row = 0, end = 0; row < all.size(); row = end) {
    for (end = row; end < all.size() && zeros(columns, kPosition, end);) ++end;
    const bool leap = end > row && ((row > 0 && leaps(row - 1, row)) || (end < all.size() && leaps(end, end - 1)));
    for (std::size_t k = row; k < end; ++k) all[k] = leap;
    end = std::max(end, row + 1);
  }
  return all;
}

/// Rows with a place, the others' latest numbers.
FlightLog placed_rows(const ForeignTable& table, const ColumnMap& map) {
  Columns columns;
  for (const auto& [ours, theirs] : map.columns) columns[ours] = in_our_units(table, map, ours);
  const std::vector<double> t_s = std::move(columns.extract("t_s").mapped());
  FlightLog log;
  const auto is_lost = lost(columns, t_s);
  std::map<std::string, double> latest;
  std::size_t unplaced = 0, again = 0, early = 0;
  for (std::size_t row = 0; row < t_s.size(); ++row) {
    for (const auto& [ours, values] : columns)
      if (!std::isnan(values[row]) && !is_lost[row]) latest[ours] = values[row];
    const double t = t_s[row];
    const bool placed = !std::isnan(t) && !is_lost[row] && std::ranges::none_of(kPosition, [&](const char* name) {
      return std::isnan(columns.at(name)[row]);
    });
    if (!placed) {
      ++unplaced;
    } else if (!log.t_s.empty() && t == log.t_s.back()) {
      ++again;
    } else if (latest.size() < columns.size()) {
      ++early;
    } else {
      log.t_s.push_back(t);
      for (const auto& [ours, value] : latest) log.columns[ours].push_back(value);
    }
  }
  for (const auto& [count, what] : {std::pair{unplaced, "hold no place (empty, or zeros of a body that was lost)"},
                                    {again, "repeat the stamp before"},
                                    {early, "come before the first number of some column"}})
    if (count > 0) log.notes.push_back(share_of_rows(count, t_s.size()) + what + ": left out");
  return log;
}

/// In all rows but one in a hundred, which turn() makes unit ones.
bool unit_quaternions(const FlightLog& log) {
  if (!has_all(log, kQuaternion)) return true;
  std::size_t wrong = 0;
  for (std::size_t row = 0; row < log.t_s.size(); ++row) {
    const Eigen::Vector4d q(log.column("qw")[row], log.column("qx")[row], log.column("qy")[row], log.column("qz")[row]);
    if (q.norm() < 0.1) return false;
    wrong += std::abs(q.norm() - 1) > 0.02 ? 1 : 0;
  }
  return wrong * 100 <= log.t_s.size();
}

void quaternion_of_angles(FlightLog& log) {
  if (!has_all(log, kAngles)) return;
  for (std::size_t row = 0; row < log.t_s.size(); ++row) {
    const Eigen::Quaterniond q = Eigen::AngleAxisd(log.column("yaw")[row], Vec3::UnitZ()) *
                                 Eigen::AngleAxisd(log.column("pitch")[row], Vec3::UnitY()) *
                                 Eigen::AngleAxisd(log.column("roll")[row], Vec3::UnitX());
    log.columns["qw"].push_back(q.w());
    log.columns["qx"].push_back(q.x());
    log.columns["qy"].push_back(q.y());
    log.columns["qz"].push_back(q.z());
  }
  for (const char* name : kAngles) log.columns.erase(name);
}

/// The time, s, from which on an acceleration runs in a straight line, up or down, until the end: somebody drew it on
/// after the last sample. Nothing: for less than a second, or not at all.
std::optional<double> drawn_on_from(const FlightLog& log, const std::string& prefix, const std::string& unit) {
  if (!has_xyz(log, prefix, unit) || log.t_s.size() < 3) return std::nullopt;
  std::size_t from = log.t_s.size() - 1;
  for (; from >= 2; --from) {
    const Vec3 after = xyz(log, prefix, unit, from), here = xyz(log, prefix, unit, from - 1);
    const double share = (log.t_s[from] - log.t_s[from - 1]) / (log.t_s[from - 1] - log.t_s[from - 2]);
    const Vec3 off = after - here - share * (here - xyz(log, prefix, unit, from - 2));
    if (!(off.norm() < 1e-5 * (1 + after.norm())) || after == here) break;
  }
  const double t = log.t_s[from - 1];
  return log.t_s.back() - t > 1.0 ? std::optional(t) : std::nullopt;
}

void cut_from(FlightLog& log, double t) {
  const auto rows = static_cast<std::size_t>(std::ranges::lower_bound(log.t_s, t) - log.t_s.begin());
  log.t_s.resize(rows);
  for (auto& [name, column] : log.columns) column.resize(rows);
}

}  // namespace

std::string share_of_rows(std::size_t some, std::size_t all) {
  return std::to_string(some) + " of " + std::to_string(all) + " rows (" +
         formatted("%.2g", 100.0 * static_cast<double>(some) / static_cast<double>(all)) + " %) ";
}

tl::expected<FlightLog, LogError> in_their_axes(const ForeignTable& table, const std::string& path,
                                                const ColumnMap& map) {
  const auto bad = [&](const std::string& what, std::size_t line = 1) {
    return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":" + std::to_string(line) + ": " + what});
  };
  for (const auto& [ours, theirs] : map.columns) {
    const auto* column = table.find(theirs.name);
    if (!column)
      return bad("no column '" + theirs.name + "', which the column map takes for " + ours + "; it has " +
                 table.names());
    if (ours != "t_s" && theirs.name == map.columns.at("t_s").name)
      return bad("column '" + theirs.name + "' is the time, and " + ours + " as well");
    if (column->text_line > 0)
      return bad("column '" + theirs.name + "' holds '" + column->text + "', which is not a finite number; give one",
                 column->text_line);
    if (theirs.unit.empty() && column->unit != unit_in_name(theirs.name) && !unit_factor(ours, column->unit))
      return bad("column '" + theirs.name + "' is in " + column->unit + ", which is no unit of " + ours +
                 ": is it that column? Else give its unit in the column map");
  }
  FlightLog log = placed_rows(table, map);
  for (const auto& [prefix, unit] : {std::pair{"specific_force_", ""}, {"a", "_mps2"}}) {
    const auto t = drawn_on_from(log, prefix, unit);
    if (!t) continue;
    cut_from(log, *t);
    log.notes.push_back("left out from " + std::to_string(*t) +
                        " s on: the acceleration runs in a straight line there, which no sensor measures");
  }
  quaternion_of_angles(log);
  if (!unit_quaternions(log))
    return bad("the attitude is no unit quaternion: is it one, and are its four columns named rightly?");
  if (map.world_to_body && log.has("qw"))
    for (const char* name : {"qx", "qy", "qz"})
      for (double& q : log.columns[name]) q = -q;
  return log;
}

}  // namespace backwash::log

// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/import_columns.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "core/log/autopilot/turned_attitude.hpp"
#include "core/log/columns/local_cubic.hpp"
#include "core/log/columns/log_columns.hpp"
#include "core/log/columns/median.hpp"

namespace backwash::log {
namespace {

using Names = std::array<const char*, 3>;
constexpr Names kPosition{"x_m", "y_m", "z_m"}, kVelocity{"vx_mps", "vy_mps", "vz_mps"},
    kMeasured{"ax_mps2", "ay_mps2", "az_mps2"}, kForce{"specific_force_x", "specific_force_y", "specific_force_z"};
constexpr Names kWorld[] = {kPosition,
                            kVelocity,
                            kMeasured,
                            {"cmd_x_m", "cmd_y_m", "cmd_z_m"},
                            {"cmd_vx_mps", "cmd_vy_mps", "cmd_vz_mps"},
                            {"cmd_ax_mps2", "cmd_ay_mps2", "cmd_az_mps2"}};
constexpr std::array<const char*, 4> kQuaternion{"qw", "qx", "qy", "qz"};

Vec3 at(const FlightLog& log, const Names& names, std::size_t row) {
  return {log.column(names[0])[row], log.column(names[1])[row], log.column(names[2])[row]};
}
void set(FlightLog& log, const Names& names, std::size_t row, const Vec3& v) {
  for (std::size_t axis = 0; axis < 3; ++axis) log.columns[names[axis]][row] = v[static_cast<Eigen::Index>(axis)];
}
void drop(FlightLog& log, std::span<const char* const> names) {
  for (const char* name : names) log.columns.erase(name);
}

Eigen::Quaterniond attitude(const FlightLog& log, std::size_t row) {
  return Eigen::Quaterniond(log.column("qw")[row], log.column("qx")[row], log.column("qy")[row], log.column("qz")[row])
      .normalized();
}

/// Their numbers in our units: rows with a position, the others' latest numbers; NaN before the first.
FlightLog in_our_units(const FlightLog& raw, const ColumnMap& map) {
  FlightLog log;
  const auto source = [&](const std::string& ours) { return map.columns.at(ours); };
  const double to_s = *unit_factor("t_s", source("t_s").unit);
  std::map<std::string, double> latest;
  const auto first = std::ranges::find_if(raw.t_s, [](double t) { return !std::isnan(t); });
  if (first == raw.t_s.end()) return log;
  for (std::size_t row = 0; row < raw.t_s.size(); ++row) {
    bool placed = !std::isnan(raw.t_s[row]);
    for (const auto& [ours, theirs] : map.columns) {
      if (ours == "t_s") continue;
      const double value = raw.column(theirs.name)[row] * *unit_factor(ours, theirs.unit);
      if (!std::isnan(value)) latest[ours] = value;
      if (std::ranges::count(kPosition, ours) && std::isnan(value)) placed = false;
    }
    const double t = (raw.t_s[row] - *first) * to_s;
    const bool again = !log.t_s.empty() && t == log.t_s.back();
    if (!placed || again || latest.size() + 1 < map.columns.size()) continue;
    log.t_s.push_back(t);
    for (const auto& [ours, value] : latest) log.columns[ours].push_back(value);
  }
  return log;
}

/// Their frames into ours: NED as (east, north, up), FRD as (forward, left, up).
void turn(FlightLog& log, const ColumnMap& map) {
  const auto enu = [](const Vec3& v) { return Vec3(v.y(), v.x(), -v.z()); };
  const auto flu = [](const Vec3& v) { return Vec3(v.x(), -v.y(), -v.z()); };
  for (std::size_t row = 0; row < log.t_s.size(); ++row) {
    if (map.ned)
      for (const Names& names : kWorld)
        if (has_all(log, names)) set(log, names, row, enu(at(log, names, row)));
    for (const char* height : {"surface_z_m", "stood_z_m"})
      if (map.ned && log.has(height)) log.columns[height][row] *= -1;
    if (has_all(log, kQuaternion)) {
      Eigen::Quaterniond q = attitude(log, row);
      if (map.ned) q = enu_of_ned(q);
      if (map.frd) q = flu_of_frd(q);
      log.columns["qw"][row] = q.w();
      log.columns["qx"][row] = q.x();
      log.columns["qy"][row] = q.y();
      log.columns["qz"][row] = q.z();
    }
    if (map.frd && has_all(log, kForce)) set(log, kForce, row, flu(at(log, kForce, row)));
  }
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
  constexpr Names kAngles{"roll", "pitch", "yaw"};
  if (!has_all(log, kAngles)) return;
  for (std::size_t row = 0; row < log.t_s.size(); ++row) {
    const Vec3 angle = at(log, kAngles, row);
    const Eigen::Quaterniond q = Eigen::AngleAxisd(angle.z(), Vec3::UnitZ()) *
                                 Eigen::AngleAxisd(angle.y(), Vec3::UnitY()) *
                                 Eigen::AngleAxisd(angle.x(), Vec3::UnitX());
    log.columns["qw"].push_back(q.w());
    log.columns["qx"].push_back(q.x());
    log.columns["qy"].push_back(q.y());
    log.columns["qz"].push_back(q.z());
  }
  drop(log, kAngles);
}

void acceleration_of_force(FlightLog& log) {
  for (const char* name : kMeasured) log.columns[name].resize(log.t_s.size());
  for (std::size_t row = 0; row < log.t_s.size(); ++row)
    set(log, kMeasured, row, attitude(log, row) * at(log, kForce, row) - Vec3(0, 0, kGravity));
  drop(log, kForce);
}

/// Velocity and acceleration of the positions, where the table has none; rows without them are left out.
FlightLog with_motion(FlightLog log) {
  const bool v = has_all(log, kVelocity), a = has_all(log, kMeasured);
  if (v && a) return log;
  if (!v) drop(log, kVelocity);
  if (!a) drop(log, kMeasured);
  std::vector<Vec3> p;
  for (std::size_t row = 0; row < log.t_s.size(); ++row) p.push_back(at(log, kPosition, row));
  const auto motion = local_cubics(log.t_s, p);
  FlightLog out;
  for (std::size_t row = 0; row < log.t_s.size(); ++row) {
    if (!motion[row]) continue;
    out.t_s.push_back(log.t_s[row]);
    for (const auto& [name, column] : log.columns) out.columns[name].push_back(column[row]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      if (!v) out.columns[kVelocity[axis]].push_back(motion[row]->v[i]);
      if (!a) out.columns[kMeasured[axis]].push_back(motion[row]->a[i]);
    }
  }
  return out;
}

/// The time, s, from which on the acceleration runs in a straight line, up or down, until the end: somebody drew it on
/// after the last sample. Nothing: for less than a second, or not at all.
std::optional<double> drawn_on_from(const FlightLog& log, const Names& names) {
  if (!has_all(log, names) || log.t_s.size() < 3) return std::nullopt;
  std::size_t from = log.t_s.size() - 1;
  for (; from >= 2; --from) {
    const Vec3 after = at(log, names, from), here = at(log, names, from - 1), before = at(log, names, from - 2);
    const double share = (log.t_s[from] - log.t_s[from - 1]) / (log.t_s[from - 1] - log.t_s[from - 2]);
    const Vec3 off = after - here - share * (here - before);
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

/// Why these stamps are none of a flight's; empty: they are.
std::string wrong_stamps(const FlightLog& log, const std::string& name) {
  if (log.t_s.size() < 100) return "fewer than 100 rows with a position; give a flight";
  for (std::size_t row = 1; row < log.t_s.size(); ++row)
    if (log.t_s[row] < log.t_s[row - 1])
      return "column '" + name + "' goes back at " + std::to_string(log.t_s[row]) + " s; one file is one flight";
  std::vector<double> steps;
  for (std::size_t row = 1; row < log.t_s.size(); ++row) steps.push_back(log.t_s[row] - log.t_s[row - 1]);
  const double step = median(std::move(steps));
  if (step > 1 / 20.0 * 1.01 || step < 1 / 5000.0)
    return "column '" + name + "' steps by " + std::to_string(step) +
           " s: a flight has 20 to 5000 rows a second; is the unit of the time right?";
  return {};
}

}  // namespace

std::vector<std::vector<std::string>> column_families() {
  std::vector<std::vector<std::string>> families;
  for (const Names& names : kWorld) families.emplace_back(names.begin(), names.end());
  families.emplace_back(kForce.begin(), kForce.end());
  families.emplace_back(kQuaternion.begin(), kQuaternion.end());
  families.push_back({"roll", "pitch", "yaw"});
  for (const std::string rotor : {"rpm", "motor"})
    families.push_back({rotor + "1", rotor + "2", rotor + "3", rotor + "4"});
  return families;
}

tl::expected<FlightLog, LogError> import_columns(const std::string& path, const ColumnMap& map,
                                                 std::vector<std::string>* notes) {
  auto log = import_unchecked(path, map, notes);
  if (!log) return log;
  const auto left_out = leave_out_doubted(*log);
  if (!left_out) return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + left_out.error()});
  if (notes)
    for (const auto& what : *left_out) notes->push_back(path + ": " + what);
  return left_out->empty() ? log : with_motion(std::move(*log));
}

tl::expected<FlightLog, LogError> import_unchecked(const std::string& path, const ColumnMap& map,
                                                   std::vector<std::string>* notes) {
  const auto bad = [&](const std::string& what) {
    return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + what});
  };
  const auto header = csv_names(path);
  if (!header) return tl::make_unexpected(header.error());
  std::set<std::string> unread(header->begin(), header->end());
  for (const auto& [ours, theirs] : map.columns) {
    if (!std::ranges::count(*header, theirs.name))
      return bad("no column '" + theirs.name + "', which the column map takes for " + ours);
    if (ours != "t_s" && theirs.name == map.columns.at("t_s").name)
      return bad("column '" + theirs.name + "' is the time, and " + ours + " as well");
    unread.erase(theirs.name);
  }
  const auto raw = read_csv(path, map.columns.at("t_s").name, unread, true);
  if (!raw) return tl::make_unexpected(raw.error());
  FlightLog log = in_our_units(*raw, map);
  for (const Names& names : {kForce, kMeasured}) {
    const auto t = drawn_on_from(log, names);
    if (!t) continue;
    cut_from(log, *t);
    if (notes)
      notes->push_back(path + ": left out from " + std::to_string(*t) +
                       " s on: the acceleration runs in a straight line there, which no sensor measures");
  }
  if (const auto why = wrong_stamps(log, map.columns.at("t_s").name); !why.empty()) return bad(why);
  quaternion_of_angles(log);
  if (!unit_quaternions(log))
    return bad("the attitude is no unit quaternion: is it one, and are its four columns named rightly?");
  turn(log, map);
  if (has_all(log, kForce)) {
    if (!has_all(log, kQuaternion)) return bad("specific force is in the body: give an attitude as well");
    acceleration_of_force(log);
  }
  log = with_motion(std::move(log));
  if (log.t_s.size() < 100)
    return bad(
        "too few rows around each position for its velocity: give 30 rows a second, or velocity and acceleration");
  return log;
}

}  // namespace backwash::log

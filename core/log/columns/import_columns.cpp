// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/import_columns.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

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
FlightLog in_our_units(const ForeignTable& table, const ColumnMap& map) {
  FlightLog log;
  const auto values = [&](const ColumnMap::Source& source) -> const std::vector<double>& {
    return table.find(source.name)->values;
  };
  const auto& time = values(map.columns.at("t_s"));
  const double to_s = *unit_factor("t_s", map.columns.at("t_s").unit);
  std::map<std::string, double> latest;
  const auto first = std::ranges::find_if(time, [](double t) { return !std::isnan(t); });
  if (first == time.end()) return log;
  for (std::size_t row = 0; row < time.size(); ++row) {
    bool placed = !std::isnan(time[row]);
    for (const auto& [ours, theirs] : map.columns) {
      if (ours == "t_s") continue;
      const double value = values(theirs)[row] * *unit_factor(ours, theirs.unit);
      if (!std::isnan(value)) latest[ours] = value;
      if (std::ranges::count(kPosition, ours) && std::isnan(value)) placed = false;
    }
    const double t = (time[row] - *first) * to_s;
    const bool again = !log.t_s.empty() && t == log.t_s.back();
    if (!placed || again || latest.size() + 1 < map.columns.size()) continue;
    log.t_s.push_back(t);
    for (const auto& [ours, value] : latest) log.columns[ours].push_back(value);
  }
  return log;
}

/// Their axes into ours: vectors of the world by `world`, of the body by `body`, attitudes by both.
void turn(FlightLog& log, const Turn& world, const Turn& body) {
  const Eigen::Quaterniond of_world(world), of_body(body);
  for (std::size_t row = 0; row < log.t_s.size(); ++row) {
    for (const Names& names : kWorld)
      if (has_all(log, names)) set(log, names, row, world * at(log, names, row));
    for (const char* height : {"surface_z_m", "stood_z_m"})
      if (log.has(height)) log.columns[height][row] *= world.row(2).sum();
    if (has_all(log, kQuaternion)) {
      const Eigen::Quaterniond q = of_world * attitude(log, row) * of_body.conjugate();
      log.columns["qw"][row] = q.w();
      log.columns["qx"][row] = q.x();
      log.columns["qy"][row] = q.y();
      log.columns["qz"][row] = q.z();
    }
    if (has_all(log, kForce)) set(log, kForce, row, body * at(log, kForce, row));
  }
}

/// What keys would turn a table whose axes are not up as its map says; empty: none is needed, or the flight does not
/// tell.
std::string wrong_axes(const FlightLog& theirs, const ColumnMap& map) {
  const auto said = [](const std::optional<Turn>& turn) { return turn.value_or(Turn::Identity()); };
  const auto key = [](const char* name, const Turn& turn, const std::vector<NamedTurn>& names) {
    return std::string("frame.") + name + " = \"" + called(turn, names) + "\"";
  };
  const auto up = up_axes(theirs);
  if (!up) {
    if (const auto body = body_up(theirs, said(map.world).transpose() * Vec3::UnitZ());
        body && said(map.body) * *body != Vec3::UnitZ())
      return "the body looks up along another axis than its z, on the mean: give " +
             key("body", upright_body(*body), named_bodies()) + ", or frame.world if its z is not up";
    const auto flat = map.world ? std::nullopt : flat_height(theirs);
    if (!flat) return {};
    return flat->first + ": which axis is up? Give " + key("world", upright_world(flat->second), named_worlds()) +
           ", or \"enu\" if z is";
  }
  std::string keys;
  if (said(map.world) * up->world != Vec3::UnitZ()) keys = key("world", upright_world(up->world), named_worlds());
  if (said(map.body) * up->body != Vec3::UnitZ())
    keys += (keys.empty() ? "" : " and ") + key("body", upright_body(up->body), named_bodies());
  return keys.empty() ? "" : "the weight and the thrust are along other axes than the map's z: give " + keys;
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
  const auto bad = [&](const std::string& what) {
    return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + what});
  };
  const auto table = read_foreign_table(path);
  if (!table) return tl::make_unexpected(table.error());
  auto theirs = in_their_axes(*table, path, map, notes);
  if (!theirs) return theirs;
  if (const auto why = wrong_axes(*theirs, map); !why.empty()) return bad(why);
  const std::size_t all = theirs->t_s.size();
  auto log = in_our_axes(std::move(*theirs), map);
  if (!log) return bad(log.error());
  const auto left_out = leave_out_doubted(*log);
  if (!left_out) return bad(left_out.error());
  const std::size_t lost = all - std::min(all, log->t_s.size());
  if (notes && lost * 50 > all)
    notes->push_back(path + ": " + std::to_string(lost) + " of " + std::to_string(all) +
                     " rows left out: beside a gap of the positions");
  if (notes)
    for (const auto& what : *left_out) notes->push_back(path + ": " + what);
  return left_out->empty() ? std::move(*log) : with_motion(std::move(*log));
}

tl::expected<FlightLog, LogError> in_their_axes(const ForeignTable& table, const std::string& path,
                                                const ColumnMap& map, std::vector<std::string>* notes) {
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
  }
  FlightLog log = in_our_units(table, map);
  for (const Names& names : {kForce, kMeasured}) {
    const auto t = drawn_on_from(log, names);
    if (!t) continue;
    cut_from(log, *t);
    if (notes)
      notes->push_back(path + ": left out from " + std::to_string(*t) +
                       " s on: the acceleration runs in a straight line there, which no sensor measures");
  }
  quaternion_of_angles(log);
  if (!unit_quaternions(log))
    return bad("the attitude is no unit quaternion: is it one, and are its four columns named rightly?");
  return log;
}

tl::expected<FlightLog, std::string> in_our_axes(FlightLog log, const ColumnMap& map) {
  if (const auto why = wrong_stamps(log, map.columns.at("t_s").name); !why.empty()) return tl::make_unexpected(why);
  if (map.world || map.body) turn(log, map.world.value_or(Turn::Identity()), map.body.value_or(Turn::Identity()));
  if (has_all(log, kForce)) {
    if (!has_all(log, kQuaternion))
      return tl::make_unexpected("specific force is in the body: give an attitude as well");
    acceleration_of_force(log);
  }
  log = with_motion(std::move(log));
  if (log.t_s.size() < 100)
    return tl::make_unexpected(
        "too few rows around each position for its velocity: give 30 rows a second, or velocity and acceleration");
  return log;
}

}  // namespace backwash::log

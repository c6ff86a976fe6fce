// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/import_columns.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <functional>
#include <span>

#include "core/log/columns/local_cubic.hpp"
#include "core/log/columns/log_columns.hpp"
#include "core/log/columns/median.hpp"
#include "core/log/columns/table_rows.hpp"

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

void acceleration_of_force(FlightLog& log) {
  for (const char* name : kMeasured) log.columns[name].resize(log.t_s.size());
  for (std::size_t row = 0; row < log.t_s.size(); ++row)
    set(log, kMeasured, row, attitude(log, row) * at(log, kForce, row) - Vec3(0, 0, kGravity));
  drop(log, kForce);
}

/// Velocity and acceleration of the positions, where the table has none; rows without them are left out.
FlightLog with_motion(FlightLog log) {
  const bool v = has_all(log, kVelocity), a = has_all(log, kMeasured);
  std::vector<Vec3> p;
  for (std::size_t row = 0; row < log.t_s.size(); ++row) p.push_back(at(log, kPosition, row));
  std::size_t held = 0;
  for (const auto& [first, next] : holds(log.t_s, p)) held += next - first;
  if (held > 0)
    log.notes.push_back(share_of_rows(held, p.size()) +
                        "hold one place for longer than 0.24 s (a body that was lost, "
                        "or stood): " +
                        (v && a ? "kept" : "left out"));
  if (v && a) return log;
  if (!v) drop(log, kVelocity);
  if (!a) drop(log, kMeasured);
  const auto motion = local_cubics_but_for_holds(log.t_s, p);
  FlightLog out;
  out.notes = std::move(log.notes);
  const auto is_inside = [](const auto& m) { return m.has_value(); };
  const auto begin = std::ranges::find_if(motion, is_inside);
  const auto end = std::find_if(motion.rbegin(), motion.rend(), is_inside).base();
  if (const auto beside =
          begin < end ? static_cast<std::size_t>(std::ranges::count_if(begin, end, std::not_fn(is_inside))) : 0;
      beside > held)
    out.notes.push_back(share_of_rows(beside - held, p.size()) + "lie beside a gap of the positions: left out");
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

std::string wrong_axes(const FlightLog& theirs, const ColumnMap& map) {
  const auto said = [](const std::optional<Turn>& turn) { return turn.value_or(Turn::Identity()); };
  const auto key = [](const char* name, const Turn& turn, const std::vector<NamedTurn>& names) {
    return std::string("frame.") + name + " = \"" + called(turn, names) + "\"";
  };
  const auto fits = [&](const AxesReading& r) {
    return said(map.world) * r.up.world == Vec3::UnitZ() && said(map.body) * r.up.body == Vec3::UnitZ();
  };
  const auto readings = axes_readings(theirs);
  if (!readings.empty() && readings.front().keys.empty() && fits(readings.front())) return {};
  std::string ways;
  for (const auto& r : readings) {
    std::string keys =
        said(map.world) * r.up.world == Vec3::UnitZ() ? "" : key("world", upright_world(r.up.world), named_worlds());
    if (said(map.body) * r.up.body != Vec3::UnitZ())
      keys += (keys.empty() ? "" : " and ") + key("body", upright_body(r.up.body), named_bodies());
    if (!r.keys.empty()) keys += (keys.empty() ? "" : " and ") + r.keys;
    ways += (ways.empty() ? "" : "; or ") + keys;
  }
  if (!ways.empty()) return "the weight and the thrust are along other axes than the map's: give " + ways;
  if (!map.world) {
    const auto flat = flat_height(theirs);
    return (flat ? flat->first : "the flight does not tell which axis of the world is up") + ": give " +
           (flat ? key("world", upright_world(flat->second), named_worlds()) + ", or " : "") +
           "frame.world = \"enu\" if z is, \"x, -z, y\" if y is, \"ned\" if z is down";
  }
  const auto body = body_up(theirs, map.world->transpose() * Vec3::UnitZ());
  if (!body || said(map.body) * *body == Vec3::UnitZ()) return {};
  return "the body looks up along another axis than its z, on the mean: give " +
         key("body", upright_body(*body), named_bodies()) + ", or another frame.world";
}

tl::expected<FlightLog, LogError> import_columns(const std::string& path, const ColumnMap& map) {
  const auto bad = [&](const std::string& what) {
    return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + what});
  };
  const auto table = read_foreign_table(path);
  if (!table) return tl::make_unexpected(table.error());
  auto theirs = in_their_axes(*table, path, map);
  if (!theirs) return theirs;
  if (const auto why = wrong_stamps(*theirs, map.columns.at("t_s").name); !why.empty()) return bad(why);
  if (const auto why = wrong_axes(*theirs, map); !why.empty()) return bad(why);
  auto log = in_our_axes(std::move(*theirs), map);
  if (!log) return bad(log.error());
  const auto left_out = leave_out_doubted(*log);
  if (!left_out) return bad(left_out.error());
  log->notes.insert(log->notes.end(), left_out->begin(), left_out->end());
  return left_out->empty() ? std::move(*log) : with_motion(std::move(*log));
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

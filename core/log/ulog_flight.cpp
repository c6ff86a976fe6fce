// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <span>

#include "core/log/log_file.hpp"
#include "core/log/ulog.hpp"

namespace backwash::log {
namespace {

/// Joins fields of other topics to the rows by the latest message before each.
class Rows {
 public:
  Rows(const ULog::Topic& base, FlightLog& log) : base_(base), log_(log) {}

  /// Column `to` = factor × field; left out unless the topic has the field and every row a finite value (rows before
  /// the first message take it).
  void join(const ULog::Topic* topic, const std::string& field, const std::string& to, double factor) {
    if (!topic || !topic->columns.contains(field) || log_.has(to)) return;
    const auto& values = topic->columns.at(field);
    std::vector<double> column;
    std::size_t k = 0;
    for (const double t : base_.t_s) {
      while (k + 1 < values.size() && topic->t_s[k + 1] <= t) ++k;
      const double value = factor * values[k];
      if (!std::isfinite(value)) {
        // Set-points that the mode does not use are NaN: hold the last one; none so far, the column cannot be filled.
        if (column.empty()) return;
        column.push_back(column.back());
      } else {
        column.push_back(value);
      }
    }
    log_.columns.emplace(to, std::move(column));
  }

 private:
  const ULog::Topic& base_;
  FlightLog& log_;
};

void keep_whole(FlightLog& log, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (!log.has(name)) {
      for (const char* other : names) log.columns.erase(other);
      return;
    }
}

void join_motors(const ULog& ulog, Rows& rows, FlightLog& log) {
  const auto* motors = ulog.find("actuator_motors");
  const ULog::Topic* outputs = nullptr;
  for (unsigned instance = 0; instance < 4 && !outputs; ++instance)  // of the output board that is there
    outputs = ulog.find("actuator_outputs", instance);
  for (int i = 0; i < 4; ++i) {
    const std::string to = std::string("motor").append(std::to_string(i + 1));
    const std::string index = std::string("[").append(std::to_string(i)).append("]");
    rows.join(motors, std::string("control").append(index), to, 1);
    rows.join(outputs, std::string("output").append(index), to,
              1e-3);  // PWM in µs: 1000 … 2000; the offset is taken out below
    if (!motors && log.has(to))
      for (double& v : log.columns[to]) v -= 1;
  }
}

/// Body FRD → NED into body FLU → ENU.
void join_attitude(const ULog& ulog, const ULog::Topic& position, FlightLog& log) {
  const auto* attitude = ulog.find("vehicle_attitude");
  if (!attitude) return;
  FlightLog q;
  Rows turned(position, q);
  for (int i = 0; i < 4; ++i) {
    const std::string name = std::string("q[").append(std::to_string(i)).append("]");
    turned.join(attitude, name, name, 1);
  }
  if (q.columns.size() != 4) return;
  for (std::size_t row = 0; row < position.t_s.size(); ++row) {
    const double w = q.column("q[0]")[row], x = q.column("q[1]")[row], y = q.column("q[2]")[row],
                 z = q.column("q[3]")[row], s = std::sqrt(0.5);
    // (0, s, s, 0) ⊗ q ⊗ (0, 1, 0, 0)
    log.columns["qw"].push_back(-s * (w + z)), log.columns["qx"].push_back(-s * (x + y));
    log.columns["qy"].push_back(s * (y - x)), log.columns["qz"].push_back(s * (z - w));
  }
}

FlightLog flight_of(const ULog& ulog, const ULog::Topic& position) {
  FlightLog log;
  for (const double t : position.t_s) log.t_s.push_back(t - position.t_s.front());
  Rows rows(position, log);
  // NED → east, north, up: x = east = y_ned, y = north = x_ned, z = −z_ned.
  rows.join(&position, "y", "x_m", 1), rows.join(&position, "x", "y_m", 1), rows.join(&position, "z", "z_m", -1);
  rows.join(&position, "vy", "vx_mps", 1), rows.join(&position, "vx", "vy_mps", 1);
  rows.join(&position, "vz", "vz_mps", -1);
  rows.join(&position, "ay", "ax_mps2", 1), rows.join(&position, "ax", "ay_mps2", 1);
  rows.join(&position, "az", "az_mps2", -1);
  // A trajectory_setpoint that another mode left empty says nothing; what the controller followed stands in the other.
  for (const char* topic : {"trajectory_setpoint", "vehicle_local_position_setpoint"}) {
    const auto* setpoint = ulog.find(topic);
    for (const auto& [x, y, z] : {std::tuple{"position[0]", "position[1]", "position[2]"}, std::tuple{"x", "y", "z"}})
      rows.join(setpoint, y, "cmd_x_m", 1), rows.join(setpoint, x, "cmd_y_m", 1), rows.join(setpoint, z, "cmd_z_m", -1);
    keep_whole(log, {"cmd_x_m", "cmd_y_m", "cmd_z_m"});
  }
  const auto* battery = ulog.find("battery_status");
  rows.join(battery, "voltage_v", "battery_v", 1);
  rows.join(battery, "temperature", "temperature_c", 1);
  join_motors(ulog, rows, log);
  rows.join(ulog.find("vehicle_thrust_setpoint"), "xyz[2]", "thrust", -1);
  rows.join(ulog.find("vehicle_attitude_setpoint"), "thrust_body[2]", "thrust", -1);  // before PX4 1.14
  join_attitude(ulog, position, log);
  return log;
}

}  // namespace

tl::expected<FlightLog, LogError> read_ulog(const std::string& path) {
  const auto content = read_log_file(path, files::kLargestTable, "a .ulg file");
  if (!content) return tl::make_unexpected(content.error());
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(content->data()), content->size());
  const auto bad = [&](const std::string& what) {
    return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + what});
  };
  const auto ulog = decode_ulog(bytes);
  if (!ulog) return bad(ulog.error());
  const auto* position = ulog->find("vehicle_local_position");
  if (!position) return bad("no topic vehicle_local_position; log it, a flight needs positions");
  FlightLog log = flight_of(*ulog, *position);
  for (const char* name : {"x_m", "y_m", "z_m"})
    if (!log.has(name)) return bad("vehicle_local_position has no finite x, y, z");
  return log;
}

}  // namespace backwash::log

// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/import_crazypad.hpp"

#include "core/types/geometry.hpp"

namespace backwash::log {
namespace {

constexpr struct {
  const char *from, *to;
  double factor;
} kColumns[] = {{"x_m", "x_m", 1},
                {"y_m", "y_m", 1},
                {"z_m", "z_m", 1},
                {"vx_mps", "vx_mps", 1},
                {"vy_mps", "vy_mps", 1},
                {"vz_mps", "vz_mps", 1},
                {"ax_g", "ax_mps2", kGravity},
                {"ay_g", "ay_mps2", kGravity},
                {"az_g", "az_mps2", kGravity},
                {"motor1", "motor1", 1 / 65535.0},
                {"motor2", "motor2", 1 / 65535.0},
                {"motor3", "motor3", 1 / 65535.0},
                {"motor4", "motor4", 1 / 65535.0},
                {"battery_mV", "battery_v", 1e-3}};

/// Without the pitch they make no attitude, and in some recordings they are nan throughout.
const std::set<std::string> kUnread = {"roll_deg", "yaw_deg"};

}  // namespace

tl::expected<FlightLog, LogError> import_crazypad(const std::string& path) {
  auto table = read_csv(path, "t_s", kUnread);
  if (!table) return table;
  FlightLog log;
  for (const auto& column : kColumns) {
    if (!table->has(column.from)) {
      return tl::make_unexpected(
          LogError{LogError::Kind::bad_data, path + ":1: no column '" + column.from + "'; give a table of CrazyPAD"});
    }
    auto values = table->column(column.from);
    for (double& v : values) v *= column.factor;
    log.columns.emplace(column.to, std::move(values));
  }
  log.t_s = std::move(table->t_s);
  return log;
}

}  // namespace backwash::log

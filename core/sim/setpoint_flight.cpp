// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/setpoint_flight.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/log/columns/log_columns.hpp"
#include "core/log/columns/median.hpp"
#include "core/types/thrust.hpp"

namespace backwash::sim {
namespace {

using RowNumbers = std::vector<std::size_t>;

/// Zero where the log does not say.
Vec3 said(const log::FlightLog& log, const std::string& prefix, const std::string& unit, std::size_t row) {
  return has_xyz(log, prefix, unit) ? xyz(log, prefix, unit, row) : Vec3(Vec3::Zero());
}

/// The heading at a row, rad; 0 without attitude.
double heading(const log::FlightLog& log, std::size_t row) {
  for (const char* name : {"qw", "qx", "qy", "qz"})
    if (!log.has(name)) return 0;
  const double w = log.column("qw")[row], x = log.column("qx")[row], y = log.column("qy")[row],
               z = log.column("qz")[row];
  return std::atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z);
}

/// The parabola of time through a column's rows that fits best; empty without the column.
std::vector<double> slow_course(const log::FlightLog& log, const std::string& name, const LoggedFlight& flight) {
  if (!log.has(name)) return {};
  const auto n = static_cast<Eigen::Index>(flight.row.size());
  Eigen::MatrixXd powers(n, n < 3 ? 1 : 3);
  Eigen::VectorXd values(n);
  const double length = std::max(flight.t_s.back(), 1e-9);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    for (Eigen::Index p = 0; p < powers.cols(); ++p)
      powers(i, p) = std::pow(flight.t_s[k] / length, static_cast<double>(p));
    values[i] = log.column(name)[flight.row[k]];
  }
  const Eigen::MatrixXd normal = powers.transpose() * powers;
  const Eigen::VectorXd course = powers * normal.ldlt().solve(powers.transpose() * values);
  return {course.data(), course.data() + n};
}

/// Rate at which the four hover, 1/min: of each its median over rows, of these the mean of the two in the middle, so
/// that one rotor that reads wrong does not move it.
std::optional<double> hover_rpm(const log::FlightLog& log, const Vehicle& vehicle, const LoggedFlight& flight) {
  std::vector<double> rotors;
  for (const char* name : {"rpm1", "rpm2", "rpm3", "rpm4"}) {
    if (!log.has(name) || !log.has("thrust")) return std::nullopt;
    std::vector<double> rates;
    for (const auto row : flight.row) {
      const double share = thrust_share(vehicle, log.column("thrust")[row]);
      const double weights = share * vehicle.propulsion.max_thrust / vehicle.body.mass / kGravity;
      rates.push_back(log.column(name)[row] / std::sqrt(std::max(weights, 0.05)));
    }
    rotors.push_back(log::median(std::move(rates)));
  }
  std::sort(rotors.begin(), rotors.end());
  const double middle = 0.5 * (rotors[1] + rotors[2]);
  return middle > 0 ? std::optional(middle) : std::nullopt;
}

/// The set-point at a time: between rows, or held where the next is far.
Setpoint at_time(const LoggedFlight& flight, std::size_t& heard, double t) {
  const auto& ts = flight.t_s;
  while (heard + 1 < ts.size() && ts[heard + 1] <= t) ++heard;
  Setpoint c = flight.commands[heard];
  if (heard + 1 >= ts.size() || ts[heard + 1] - ts[heard] > 0.1 || t < ts[heard]) return c;
  const double share = (t - ts[heard]) / (ts[heard + 1] - ts[heard]);
  const Setpoint& next = flight.commands[heard + 1];
  c.p_W += share * (next.p_W - c.p_W);
  c.v_W += share * (next.v_W - c.v_W);
  c.a_W += share * (next.a_W - c.a_W);
  return c;
}

}  // namespace

tl::expected<LoggedFlight, log::LogError> logged_flight(const log::FlightLog& log, const Vehicle& vehicle,
                                                        const std::string& path) {
  const auto wrong = [&](const std::string& what) {
    return tl::unexpected(log::LogError{log::LogError::Kind::bad_data, path + ":1: " + what});
  };
  if (!has_xyz(log, "", "_m")) return wrong("no positions; a flight to be flown again needs x_m, y_m, z_m");
  if (!has_xyz(log, "cmd_", "_m"))
    return wrong("no set-points; a flight to be flown again needs cmd_x_m, cmd_y_m, cmd_z_m");
  LoggedFlight flight;
  for (std::size_t i = 0; i < log.t_s.size(); ++i) {
    if (!flight.row.empty() && !(log.t_s[i] > log.t_s[flight.row.back()])) continue;
    flight.row.push_back(i);
    flight.t_s.push_back(log.t_s[i] - log.t_s[flight.row.front()]);
    flight.commands.push_back(
        {said(log, "cmd_", "_m", i), said(log, "cmd_v", "_mps", i), said(log, "cmd_a", "_mps2", i), heading(log, i)});
    const double segment = log.has("segment") ? log.column("segment")[i] : -1;
    flight.segment.push_back(segment >= 0 ? std::optional(static_cast<int>(std::min(segment, 1e9))) : std::nullopt);
  }
  if (flight.row.size() < 2) return wrong("fewer than 2 rows with rising stamps");
  flight.start = {said(log, "", "_m", flight.row.front()), said(log, "v", "_mps", flight.row.front())};
  flight.voltage = slow_course(log, "battery_v", flight);
  flight.temperature = slow_course(log, "temperature_c", flight);
  flight.hover_rpm = hover_rpm(log, vehicle, flight);
  return flight;
}

std::vector<FlightSample> fly_setpoints(const map::OccupancyGrid& grid, const Vehicle& vehicle,
                                        const LoggedFlight& flight, std::uint64_t seed, Simulation simulation) {
  if (!simulation.hover_rpm) simulation.hover_rpm = flight.hover_rpm;
  ClosedLoop loop(grid, vehicle, flight.start, seed, simulation);
  const double age = flight.t_s.back() / static_cast<double>(flight.t_s.size() - 1) / 4;
  std::vector<FlightSample> samples;
  std::size_t heard = 0;
  for (std::size_t i = 0; i < flight.t_s.size(); ++i) {
    const auto given = [i](const std::vector<double>& x) {
      return x.empty() ? std::optional<double>() : std::optional(x[i]);
    };
    loop.set_conditions(flight.commands[i].yaw, given(flight.voltage), given(flight.temperature));
    while (loop.time() + 0.5 * Quadrotor::kStep < flight.t_s[i]) loop.step(at_time(flight, heard, loop.time() - age));
    samples.push_back(loop.sample(flight.commands[i], flight.segment[i]));
    samples.back().t = flight.t_s[i];
  }
  return samples;
}

log::FlightLog to_log(const std::vector<FlightSample>& samples, const LoggedFlight& flight,
                      const log::FlightLog& from) {
  log::FlightLog log = to_log(samples, true);
  for (auto& t : log.t_s) t += from.t_s[flight.row.front()];
  for (const char* name : {"battery_v", "temperature_c", "surface_z_m", "stood_z_m", "ceiling", "day"}) {
    if (!from.has(name)) continue;
    auto& column = log.columns[name];
    for (const auto row : flight.row) column.push_back(from.column(name)[row]);
  }
  if (!from.has("segment")) log.columns.erase("segment");
  return log;
}

}  // namespace backwash::sim

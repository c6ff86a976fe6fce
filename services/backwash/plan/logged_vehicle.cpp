// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/plan/logged_vehicle.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "core/log/autopilot/airframe.hpp"
#include "core/log/columns/labels.hpp"
#include "core/log/columns/log_columns.hpp"
#include "core/log/kinds/recording.hpp"
#include "core/types/angle.hpp"
#include "core/types/formatted.hpp"
#include "core/types/geometry.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/plan/firmware_gains.hpp"
#include "services/backwash/plan/vehicle_file.hpp"
#include "services/command_line/words.hpp"

namespace backwash::services {
namespace {

constexpr double kWindow = 2, kSlow = 3, kStill = 0.5;  // s, m/s: a steady tilt for 3 m/s is 1 % of thrust
constexpr double kInTheAir = 0.35;                      // of the strongest window: an idling rotor's is less

double quantile(std::vector<double> values, double q) {
  const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1) + 0.5);
  std::ranges::nth_element(values, values.begin() + at);
  return values[static_cast<std::size_t>(at)];
}

/// What a log says of its hover.
struct Hovered {
  std::optional<Shown> thrust;
  std::size_t windows = 0;  ///< slower than kStill
  double airborne_s = 0;
};

/// Thrust and speed of windows one behind another. Those that hold kInTheAir of the strongest are in the air.
Hovered hovered(const log::FlightLog& log) {
  Hovered all;
  if (!log.has("thrust") || !log::has_xyz(log, "v", "_mps")) return all;
  struct Window {
    double u, weight;  ///< mean thrust; that without what the climb's change took
    double speed;      ///< largest
  };
  std::vector<Window> windows;
  const auto& thrust = log.column("thrust");
  for (std::size_t first = 0, row = 0; row < log.t_s.size(); ++row) {
    const double passed = log.t_s[row] - log.t_s[first];
    if (passed < kWindow) continue;
    if (row > first + 4 && passed < 2 * kWindow) {
      Window w{0, 0, 0};
      for (std::size_t k = first; k < row; ++k) {
        w.u += thrust[k] / static_cast<double>(row - first);
        w.speed = std::max(w.speed, log::xyz(log, "v", "_mps", k).norm());
      }
      w.weight = w.u / (1 + (log.column("vz_mps")[row] - log.column("vz_mps")[first]) / passed / kGravity);
      windows.push_back(w);
    }
    first = row;
  }
  const double most = windows.empty() ? 0 : std::ranges::max(windows, {}, &Window::u).u;
  std::vector<double> hover;
  for (const auto& w : windows) {
    if (w.u < kInTheAir * most) continue;
    all.airborne_s += kWindow;
    all.windows += w.speed < kStill ? 1 : 0;
    if (w.speed < kSlow) hover.push_back(w.weight);
  }
  if (hover.size() >= 3 && most > 0)
    all.thrust = Shown{quantile(hover, 0.5), quantile(hover, 0.05), quantile(hover, 0.95)};
  return all;
}

/// Where a body's z axis points, along the first two axes of the world.
Eigen::Vector2d lean_of(const log::TopicLog::Topic& topic, const std::string& q, std::size_t row) {
  const auto part = [&](int i) { return topic.columns.at(q + "[" + std::to_string(i) + "]")[row]; };
  return {2 * (part(1) * part(3) + part(0) * part(2)), 2 * (part(2) * part(3) - part(0) * part(1))};
}

/// The lag of first order that makes of set-points what the attitude did, in these rows; none where they hardly lean.
std::optional<double> lag_of(const log::TopicLog::Topic& asked, const log::TopicLog::Topic& flown, std::size_t first,
                             std::size_t end) {
  constexpr double kLeastLean = 0.01, kMostLeft = 0.5;  // rad, rms; of what leans: else something else leans it
  double best = 0, left = 0, all = 0;
  for (double lag = 0.01; lag < 0.6; lag *= 1.1) {
    Eigen::Vector2d answer = lean_of(flown, "q", first), mean = Eigen::Vector2d::Zero();
    double squares = 0, leans = 0;
    for (std::size_t k = first; k < end; ++k) mean += lean_of(flown, "q", k) / static_cast<double>(end - first);
    for (std::size_t k = first + 1; k < end; ++k) {
      const double h = flown.t_s[k] - flown.t_s[k - 1];
      const auto after = std::ranges::upper_bound(asked.t_s, flown.t_s[k - 1]) - asked.t_s.begin();
      if (after == 0 || h > 0.5) {
        answer = lean_of(flown, "q", k);
        continue;
      }
      const Eigen::Vector2d to = lean_of(asked, "q_d", static_cast<std::size_t>(after) - 1),
                            is = lean_of(flown, "q", k);
      answer += (1 - std::exp(-h / lag)) * (to - answer);
      squares += (answer - is).squaredNorm();
      leans += (is - mean).squaredNorm();
    }
    if (!std::isfinite(squares)) return std::nullopt;
    if (all == 0 || squares < left) std::tie(best, left) = std::pair{lag, squares};
    all = leans;
  }
  if (all < kLeastLean * kLeastLean * static_cast<double>(end - first) || left > kMostLeft * all) return std::nullopt;
  return best;
}

void look_at_attitude(LoggedVehicle& logged) {
  const auto* asked = logged.topics.find("vehicle_attitude_setpoint");
  const auto* flown = logged.topics.find("vehicle_attitude");
  if (!asked || !flown || !asked->columns.contains("q_d[3]") || !flown->columns.contains("q[3]")) return;
  std::vector<double> lags;
  const std::size_t rows = flown->t_s.size(), parts = 4;
  for (std::size_t part = 0; part < parts && rows > 100; ++part)
    if (const auto lag = lag_of(*asked, *flown, part * rows / parts, (part + 1) * rows / parts)) lags.push_back(*lag);
  if (lags.size() < 2) return;
  logged.attitude_lag = Shown{quantile(lags, 0.5), std::ranges::min(lags), std::ranges::max(lags)};
}

}  // namespace

LoggedVehicle logged_vehicle(const std::string& path) {
  LoggedVehicle logged;
  logged.path = path;
  logged.topics = read_or_fail(log::read_autopilots_log(path));
  logged.kind = read_or_fail(log::recording_of(path))->words;
  auto flight = log::flight_of(logged.topics);
  if (!flight) throw Failure(kBadData, path + ":1: " + flight.error());
  logged.flight = std::move(*flight);
  const auto hover = hovered(logged.flight);
  logged.hover = hover.thrust;
  logged.hover_windows = hover.windows;
  logged.airborne_s = hover.airborne_s;
  look_at_attitude(logged);
  return logged;
}

std::optional<std::pair<std::string, double>> stated_hover(const std::map<std::string, double>& parameters) {
  for (const char* name : {"MPC_THR_HOVER", "MOT_THST_HOVER"})
    if (const auto found = parameters.find(name); found != parameters.end() && found->second > 0) return *found;
  return std::nullopt;
}

std::vector<SourcedValue> sourced_values(const LoggedVehicle& logged) {
  Vehicle v = read_vehicle("builtin:quad-5in");
  const auto& p = logged.topics.parameters;
  std::string gains = "default: the log holds no gains of the position loop", integrals = gains;
  try {
    const auto firmware = take_gains(p, logged.path, v);
    using firmware_bridge::Ask;
    gains = "parameters " + firmware.name(Ask::k_d_horizontal) + ", " + firmware.name(Ask::k_p_horizontal) + ", " +
            firmware.name(Ask::k_d_vertical) + ", " + firmware.name(Ask::k_p_vertical);
    integrals = firmware.left_out.empty()
                    ? "parameters " + firmware.name(Ask::k_i_horizontal) + ", " + firmware.name(Ask::k_i_vertical)
                    : firmware.left_out;
  } catch (const Failure&) {
    // A log of before its parameters: the defaults stay.
  }
  const bool px4 = logged.kind.find("PX4") != std::string::npos;
  const auto factor = p.find("THR_MDL_FAC");
  const double f = px4 ? (factor == p.end() ? 0 : factor->second) : 0;
  std::vector<SourcedValue> values{
      {"body.radius", v.body.radius, "default: measure it, centre to the farthest tip"},
      {"body.diagonal_radius", v.body.diagonal_radius, "default: measure it, centre to rotor axis, plus the rotor"},
      {"body.rotor_radius", v.body.rotor_radius, "default: measure it"},
      {"body.mass", v.body.mass, "default: weigh it, battery in; then scale propulsion.max_thrust alike"},
      {"controller.kp.horizontal", v.controller.kp.horizontal, gains},
      {"controller.kp.vertical", v.controller.kp.vertical, gains},
      {"controller.kd.horizontal", v.controller.kd.horizontal, gains},
      {"controller.kd.vertical", v.controller.kd.vertical, gains},
      {"controller.latency", v.controller.latency, "default"},
      {"controller.feedback_delay", v.controller.feedback_delay, "default"}};
  const auto& integral = v.controller.velocity_integrator;
  if (integral.horizontal > 0) {
    values.push_back({"controller.velocity_integrator.horizontal", integral.horizontal, integrals});
    values.push_back({"controller.velocity_integrator.vertical", integral.vertical, integrals});
  }
  values.push_back(logged.attitude_lag ? SourcedValue{"controller.attitude_lag", logged.attitude_lag->value,
                                                      formatted("fitted, %.2g to %.2g in parts of the flight",
                                                                logged.attitude_lag->low, logged.attitude_lag->high)}
                                       : SourcedValue{"controller.attitude_lag", v.controller.attitude_lag, "default"});
  values.push_back({"estimation.position", v.estimation.position, "default: measure it"});
  const auto share = [&](double u) { return f * u * u + (1 - f) * u; };
  const double weight = v.body.mass * kGravity;
  if (logged.hover)
    values.push_back({"propulsion.max_thrust", weight / share(logged.hover->value),
                      formatted("fitted to the hover at %.3g, %.3g to %.3g for this mass", logged.hover->value,
                                weight / share(logged.hover->high), weight / share(logged.hover->low))});
  else if (const auto stated = stated_hover(p))
    values.push_back({"propulsion.max_thrust", weight / share(stated->second),
                      "parameter " + stated->first + ": the log holds no hover"});
  else
    values.push_back({"propulsion.max_thrust", v.propulsion.max_thrust, "default: the log holds no hover"});
  values.push_back({"propulsion.thr_mdl_fac", f,
                    px4 ? factor == p.end() ? "default of PX4" : "parameter THR_MDL_FAC"
                        : "0: ArduPilot's thrust is linear, by MOT_THST_EXPO"});
  // Limits are what the owner wants, within what the autopilot grants.
  const auto within = [&](double wanted, std::optional<Granted> granted) -> std::pair<double, std::string> {
    if (!granted) return {wanted, "default"};
    const std::string by = formatted(" %s grants %.3g", granted->name.c_str(), granted->value);
    return granted->value < wanted ? std::pair{granted->value, "parameter:" + by} : std::pair{wanted, "default:" + by};
  };
  auto push = least_granted(p, firmware_bridge::Ask::a_max);
  if (auto lean = least_granted(p, firmware_bridge::Ask::lean)) {
    lean->value = kGravity * std::tan(lean->value * kDegree) / std::sqrt(2);
    if (!push || lean->value < push->value) push = lean;
  }
  const auto speed = within(v.limits.v_max, least_granted(p, firmware_bridge::Ask::v_max));
  const auto acceleration = within(v.limits.a_max, push);
  values.push_back({"limits.v_max", speed.first, speed.second});
  values.push_back({"limits.a_max", acceleration.first, acceleration.second});
  values.push_back({"initial_error.position", v.initial_error.position, "default"});
  values.push_back({"initial_error.velocity", v.initial_error.velocity, "default"});
  return values;
}

std::string another_vehicle(const log::FlightLog& log, const Vehicle& vehicle) {
  constexpr double kMostApart = 1.25;  // a battery's fall and a payload are less
  const double file = hover_command(vehicle);
  const auto hover = hovered(log).thrust;
  if (!hover || std::max(file / hover->value, hover->value / file) < kMostApart) return {};
  return formatted("this log hovers at %.2f, the vehicle file says %.2f: another vehicle", hover->value, file);
}

namespace {

struct VehicleFromOptions {
  std::string log, out;
  bool force = false;
};

std::string toml_of(const LoggedVehicle& logged) {
  std::string text = "# From " + std::filesystem::path(logged.path).filename().string() + ", " + logged.kind +
                     ", by backwash vehicle from. Behind each value: who says it.\nname = \"" +
                     log::recording_name(logged.path) + "\"\n";
  std::string table;
  for (const auto& [key, value, source] : sourced_values(logged)) {
    const auto dot = key.find('.');
    if (key.substr(0, dot) != table) text += "\n[" + (table = key.substr(0, dot)) + "]\n";
    text += key.substr(dot + 1) + formatted(" = %.6g  # ", value) + source + "\n";
  }
  return text;
}

int from_log(const VehicleFromOptions& options) {
  check_output(options.out, options.force);
  const auto logged = logged_vehicle(options.log);
  const auto text = toml_of(logged);
  for (const auto& note : logged.flight.notes) say_error("backwash vehicle from", options.log + ":1: " + note);
  if (options.out.empty())
    std::fputs(text.c_str(), stdout);
  else
    write_file(options.out, text, options.force);
  return kOk;
}

}  // namespace

Verb vehicle_from_verb(Command& group) {
  const auto options = std::make_shared<VehicleFromOptions>();
  auto& command = group.add_subcommand("from", "A vehicle file from one autopilot's log, each value with its source");
  command.add_option("log", options->log, "the autopilot's own").required();
  command.add_option("--out", options->out, "vehicle file to write, else printed");
  command.add_flag("--force", options->force, "overwrite --out");
  command.footer("Example:\n  backwash vehicle from flight.ulg --out own.vehicle.toml");
  return {&command, [options] { return from_log(*options); }};
}

}  // namespace backwash::services

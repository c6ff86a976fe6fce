// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "core/log/autopilot/airframe.hpp"
#include "core/log/autopilot/turned_attitude.hpp"
#include "core/log/mcap/topic_log.hpp"
#include "core/types/formatted.hpp"
#include "core/types/geometry.hpp"

namespace backwash::log {
namespace {

constexpr double kLeastRate = 20, kMostRate = 100;  // Hz, of a flight's rows
constexpr double kMostApart = 0.5;                  // s between messages; more is a gap

/// Joins fields of other topics to the rows by the latest message before each.
class TopicRows {
 public:
  TopicRows(const TopicLog::Topic& base, FlightLog& log) : base_(base), log_(log) {}

  /// Column `to` = factor × field; left out unless the topic has the field and every row a finite value (rows before
  /// the first message take it).
  void join(const TopicLog::Topic* topic, const std::string& field, const std::string& to, double factor) {
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
  const TopicLog::Topic& base_;
  FlightLog& log_;
};

void keep_whole(FlightLog& log, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (!log.has(name)) {
      for (const char* other : names) log.columns.erase(other);
      return;
    }
}

void join_motors(const TopicLog& topics, TopicRows& rows, FlightLog& log) {
  const auto* motors = topics.find("actuator_motors");
  const TopicLog::Topic* outputs = nullptr;
  for (unsigned instance = 0; instance < 4 && !outputs; ++instance)  // of the output board that is there
    outputs = topics.find("actuator_outputs", instance);
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

/// Messages a second, without the gaps: a log may hold two flights.
double rate(const TopicLog::Topic& topic) {
  double steps = 0, span = 0;
  for (std::size_t k = 1; k < topic.t_s.size(); ++k) {
    const double step = topic.t_s[k] - topic.t_s[k - 1];
    if (step > kMostApart) continue;
    steps += 1;
    span += step;
  }
  return span > 0 ? steps / span : 0;
}

/// The accelerometer's topic that was logged most often, and what its three columns are called without their index.
std::pair<const TopicLog::Topic*, std::string> accelerometer(const TopicLog& topics) {
  std::pair<const TopicLog::Topic*, std::string> best{nullptr, {}};
  for (const auto& [topic, field] :
       {std::pair{"vehicle_acceleration", "xyz"}, {"sensor_combined", "accelerometer_m_s2"}}) {
    const auto* found = topics.find(topic);
    if (!found || !found->columns.contains(std::string(field) + "[2]") || rate(*found) < kLeastRate) continue;
    if (!best.first || rate(*found) > rate(*best.first)) best = {found, field};
  }
  return best;
}

/// Row k and the share of the way to the next one, of the messages around a time; nothing in a gap or outside.
std::optional<std::pair<std::size_t, double>> between(const TopicLog::Topic& topic, double t, double most_apart) {
  const auto after = std::ranges::upper_bound(topic.t_s, t);
  if (after == topic.t_s.begin() || after == topic.t_s.end()) return std::nullopt;
  const auto k = static_cast<std::size_t>(after - topic.t_s.begin()) - 1;
  const double h = topic.t_s[k + 1] - topic.t_s[k];
  if (h > most_apart) return std::nullopt;
  return std::pair{k, (t - topic.t_s[k]) / h};
}

constexpr const char* kLeftOut = "left out";  // column: messages so far that are not valid

/// Whether the estimator set its position anew between message k and the next one, or did not know it.
bool reset_after(const TopicLog::Topic& position, std::size_t k) {
  return std::ranges::any_of(std::array{"xy_reset_counter", "z_reset_counter", kLeftOut}, [&](const char* counter) {
    const auto found = position.columns.find(counter);
    return found != position.columns.end() && found->second[k] != found->second[k + 1];
  });
}

Eigen::Quaterniond attitude_at(const TopicLog::Topic& attitude, std::size_t row) {
  const auto part = [&](int i) { return attitude.columns.at("q[" + std::to_string(i) + "]")[row]; };
  return Eigen::Quaterniond(part(0), part(1), part(2), part(3)).normalized();
}
/// A share of the way from message k to the next.
Eigen::Quaterniond attitude_at(const TopicLog::Topic& attitude, std::size_t k, double share) {
  return attitude_at(attitude, k).slerp(share, attitude_at(attitude, k + 1));
}

/// Body FRD → NED into body FLU → ENU: between two messages turned from one to the other, else the latest before.
void join_attitude(const TopicLog& topics, const TopicLog::Topic& position, FlightLog& log) {
  const auto* attitude = topics.find("vehicle_attitude");
  if (!attitude) return;
  for (int i = 0; i < 4; ++i)
    if (!attitude->columns.contains("q[" + std::to_string(i) + "]")) return;
  for (const double t : position.t_s) {
    const auto at = between(*attitude, t, kMostApart);
    const auto before = std::ranges::upper_bound(attitude->t_s, t) - attitude->t_s.begin();
    const Eigen::Quaterniond q = flu_of_frd(
        enu_of_ned(at ? attitude_at(*attitude, at->first, at->second)
                      : attitude_at(*attitude, static_cast<std::size_t>(std::max<std::ptrdiff_t>(before - 1, 0)))));
    log.columns["qw"].push_back(q.w());
    log.columns["qx"].push_back(q.x());
    log.columns["qy"].push_back(q.y());
    log.columns["qz"].push_back(q.z());
  }
}

/// Local positions (NED) as often as the accelerometer measures, at most kMostRate: PX4 logs positions at 5 to 10 Hz.
/// Between two messages they follow the cubic that has both positions and velocities; the acceleration is the specific
/// force's mean, turned by the attitude, without gravity. Nothing where the accelerometer or the attitude is missing.
std::optional<TopicLog::Topic> densified(const TopicLog& topics, const TopicLog::Topic& position) {
  const auto [force, field] = accelerometer(topics);
  const auto* attitude = topics.find("vehicle_attitude");
  if (!force || !attitude || !attitude->columns.contains("q[3]") || !position.columns.contains("vz"))
    return std::nullopt;
  const auto each = static_cast<std::size_t>(std::max(1.0, std::round(rate(*force) / kMostRate)));
  TopicLog::Topic dense{position.name, 0, {}, {}};
  for (std::size_t first = 0; first + each <= force->t_s.size(); first += each) {
    double t = 0;
    Eigen::Vector3d f = Eigen::Vector3d::Zero();
    for (std::size_t row = first; row < first + each; ++row) {
      t += force->t_s[row] / static_cast<double>(each);
      for (int i = 0; i < 3; ++i)
        f[i] += force->columns.at(field + "[" + std::to_string(i) + "]")[row] / static_cast<double>(each);
    }
    const auto p = between(position, t, kMostApart), q = between(*attitude, t, kMostApart);
    if (!p || !q || reset_after(position, p->first)) continue;
    const Eigen::Vector3d a = attitude_at(*attitude, q->first, q->second) * f + Eigen::Vector3d(0, 0, kGravity);
    const double s = p->second, h = position.t_s[p->first + 1] - position.t_s[p->first];
    dense.t_s.push_back(t);
    for (int i = 0; i < 3; ++i) {
      const std::string axis(1, "xyz"[i]), speed = "v" + axis;
      const double* at = &position.columns.at(axis)[p->first];
      const double* v = &position.columns.at(speed)[p->first];
      dense.columns[axis].push_back((1 + 2 * s) * (1 - s) * (1 - s) * at[0] + s * s * (3 - 2 * s) * at[1] +
                                    h * s * (1 - s) * ((1 - s) * v[0] - s * v[1]));
      dense.columns[speed].push_back((1 - s) * v[0] + s * v[1]);
      dense.columns["a" + axis].push_back(a[i]);
    }
  }
  return dense;
}

FlightLog flight_of(const TopicLog& topics, const TopicLog::Topic& position) {
  FlightLog log;
  for (const double t : position.t_s) log.t_s.push_back(t - position.t_s.front());
  TopicRows rows(position, log);
  // NED → east, north, up: x = east = y_ned, y = north = x_ned, z = −z_ned.
  rows.join(&position, "y", "x_m", 1);
  rows.join(&position, "x", "y_m", 1);
  rows.join(&position, "z", "z_m", -1);
  rows.join(&position, "vy", "vx_mps", 1);
  rows.join(&position, "vx", "vy_mps", 1);
  rows.join(&position, "vz", "vz_mps", -1);
  rows.join(&position, "ay", "ax_mps2", 1);
  rows.join(&position, "ax", "ay_mps2", 1);
  rows.join(&position, "az", "az_mps2", -1);
  // A trajectory_setpoint that another mode left empty says nothing; what the controller followed stands in the other.
  for (const char* topic : {"trajectory_setpoint", "vehicle_local_position_setpoint"}) {
    const auto* setpoint = topics.find(topic);
    for (const auto& [x, y, z] : {std::tuple{"position[0]", "position[1]", "position[2]"}, std::tuple{"x", "y", "z"}}) {
      rows.join(setpoint, y, "cmd_x_m", 1);
      rows.join(setpoint, x, "cmd_y_m", 1);
      rows.join(setpoint, z, "cmd_z_m", -1);
    }
    keep_whole(log, {"cmd_x_m", "cmd_y_m", "cmd_z_m"});
  }
  const auto* battery = topics.find("battery_status");
  rows.join(battery, "voltage_v", "battery_v", 1);
  rows.join(battery, "temperature", "temperature_c", 1);
  join_motors(topics, rows, log);
  rows.join(topics.find("vehicle_thrust_setpoint"), "xyz[2]", "thrust", -1);
  rows.join(topics.find("vehicle_attitude_setpoint"), "thrust_body[2]", "thrust", -1);  // before PX4 1.14
  join_attitude(topics, position, log);
  return log;
}

}  // namespace

namespace {

/// The messages whose position and velocity the estimator calls valid; `notes`: what is left out.
TopicLog::Topic valid_ones(const TopicLog::Topic& position, std::vector<std::string>& notes) {
  std::vector<char> valid(position.t_s.size(), 1);
  for (const auto& [flag, what] : {std::pair{"xy_valid", "position along x and y"},
                                   {"z_valid", "height"},
                                   {"v_xy_valid", "velocity along x and y"},
                                   {"v_z_valid", "vertical velocity"}}) {
    const auto said = position.columns.find(flag);
    if (said == position.columns.end()) continue;
    std::size_t wrong = 0;
    for (std::size_t k = 0; k < valid.size(); ++k) {
      wrong += said->second[k] == 0 ? 1 : 0;
      valid[k] = valid[k] != 0 && said->second[k] != 0 ? 1 : 0;
    }
    if (wrong > 0)
      notes.push_back(formatted("its %s is not valid in %.3g %% of the messages, as its estimator says (%s)", what,
                                100.0 * static_cast<double>(wrong) / static_cast<double>(valid.size()), flag));
  }
  TopicLog::Topic kept{position.name, position.instance, {}, {}};
  double left_out = 0;
  for (std::size_t k = 0; k < valid.size(); ++k) {
    if (valid[k] == 0) {
      left_out += 1;
      continue;
    }
    kept.t_s.push_back(position.t_s[k]);
    kept.columns[kLeftOut].push_back(left_out);
    for (const auto& [name, column] : position.columns) kept.columns[name].push_back(column[k]);
  }
  return kept;
}

tl::expected<FlightLog, std::string> whole_flight(const TopicLog& topics) {
  const auto* logged = topics.find("vehicle_local_position");
  if (!logged) return tl::make_unexpected("no topic vehicle_local_position; log it, a flight needs positions");
  const auto frame = airframe_of(topics);
  if (!frame.other.empty())
    return tl::make_unexpected("is the log of " + frame.other + "; all here is about multicopters, give one's");
  std::vector<std::string> notes;
  const auto valid = valid_ones(*logged, notes);
  const auto* position = &valid;
  if (valid.t_s.empty()) return tl::make_unexpected(notes.front() + ": nothing is left");
  const auto dense = rate(*position) < kLeastRate ? densified(topics, *position) : std::nullopt;
  FlightLog log = flight_of(topics, dense && dense->t_s.size() > position->t_s.size() ? *dense : *position);
  log.notes = std::move(notes);
  if (frame.rotors != 4 && std::erase_if(log.columns, [](const auto& c) { return c.first.starts_with("motor"); }) > 0)
    log.notes.push_back(
        formatted("it has %d rotors: its motors are left out, for those of four alone are tested", frame.rotors));
  for (const char* name : {"x_m", "y_m", "z_m"})
    if (!log.has(name)) return tl::make_unexpected("vehicle_local_position has no finite x, y, z");
  return log;
}

}  // namespace

tl::expected<FlightLog, std::string> flight_of(const TopicLog& topics) {
  auto log = whole_flight(topics);
  for (const auto& words : topics.loss.words()) log ? log->notes.push_back(words) : void(log.error() += "; " + words);
  return log;
}

}  // namespace backwash::log

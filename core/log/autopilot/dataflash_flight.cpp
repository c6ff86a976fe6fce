// SPDX-License-Identifier: BSD-3-Clause
// ArduPilot's messages under PX4's names.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/log/autopilot/dataflash.hpp"
#include "core/types/angle.hpp"

namespace backwash::log {
namespace {

/// What one of PX4's fields is, of a message of ArduPilot's: factor × field.
struct Same {
  const char *field, *of;
  double factor = 1;
};

/// `to` from the fields of `from`; nothing if the log has no such message or it lacks one of them.
void translate(const TopicLog::Topic* from, const char* to, std::initializer_list<Same> fields, TopicLog& out) {
  if (!from) return;
  TopicLog::Topic topic{to, 0, from->t_s, {}};
  for (const auto& [field, of, factor] : fields) {
    const auto found = from->columns.find(of);
    if (found == from->columns.end() || found->second.size() != from->t_s.size()) return;
    auto& column = topic.columns[field] = found->second;
    for (double& value : column) value *= factor;
  }
  out.topics.push_back(std::move(topic));
}

/// The estimator that the flight was controlled by: EKF3 writes XKF1 …, EKF2 (to Copter 4.0) NKF1 ….
std::string estimator(const TopicLog& log) {
  const auto type = log.parameters.find("AHRS_EKF_TYPE");
  if (type != log.parameters.end() && type->second == 2 && log.find("NKF1")) return "NKF";
  return log.find("XKF1") || !log.find("NKF1") ? "XKF" : "NKF";
}

/// The core of it that was in use most of the time.
unsigned core_in_use(const TopicLog& log, const std::string& ekf) {
  std::map<unsigned, std::size_t> used;
  for (const auto& topic : log.topics)
    if (topic.name == ekf + "4" && topic.columns.contains("PI"))
      for (const double core : topic.columns.at("PI"))
        if (core >= 0) used[static_cast<unsigned>(core)] += 1;
  const auto most = std::ranges::max_element(used, {}, [](auto& u) { return u.second; });
  return most == used.end() ? 0 : most->first;
}

/// Message `number` of a core: an instance of it, or, to Copter 4.0, five numbers later with each core.
const TopicLog::Topic* message_of(const TopicLog& log, const std::string& ekf, unsigned number, unsigned core) {
  const auto* found = log.find(ekf + std::to_string(number), core);
  return found ? found : log.find(ekf + std::to_string(number + 5 * core));
}

/// What the estimator says of its solution (nav_filter_status, AP_NavEKF), as PX4's flags beside its positions.
void validity(const TopicLog::Topic* status, TopicLog& out) {
  constexpr unsigned kVelocityLevel = 1 << 1, kVelocityUp = 1 << 2, kLevel = 1 << 3 | 1 << 4, kHeight = 1 << 5;
  constexpr unsigned kConstantPosition = 1 << 7;  // without any aid: it holds where it was
  if (!status || !status->columns.contains("SS") || out.topics.empty()) return;
  TopicLog::Topic& position = out.topics.back();
  for (const double t : position.t_s) {
    const auto after = std::ranges::upper_bound(status->t_s, t) - status->t_s.begin();
    const double ss = status->columns.at("SS")[static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - 1, 0))];
    const auto bits = static_cast<unsigned>(ss);
    const bool aided = (bits & kConstantPosition) == 0;
    position.columns["xy_valid"].push_back(aided && (bits & kLevel) != 0 ? 1 : 0);
    position.columns["z_valid"].push_back((bits & kHeight) != 0 ? 1 : 0);
    position.columns["v_xy_valid"].push_back(aided && (bits & kVelocityLevel) != 0 ? 1 : 0);
    position.columns["v_z_valid"].push_back((bits & kVelocityUp) != 0 ? 1 : 0);
  }
}

/// Roll, pitch and yaw in degrees as a quaternion, body FRD → NED.
void attitude(const TopicLog& log, TopicLog& out) {
  const auto* from = log.find("ATT");
  if (!from || !from->columns.contains("Roll") || !from->columns.contains("Pitch") || !from->columns.contains("Yaw"))
    return;
  TopicLog::Topic topic{"vehicle_attitude", 0, from->t_s, {}};
  for (std::size_t k = 0; k < from->t_s.size(); ++k) {
    const auto about = [&](const char* angle, const Eigen::Vector3d& axis) {
      return Eigen::AngleAxisd(from->columns.at(angle)[k] * kDegree, axis);
    };
    const Eigen::Quaterniond q = about("Yaw", Eigen::Vector3d::UnitZ()) * about("Pitch", Eigen::Vector3d::UnitY()) *
                                 about("Roll", Eigen::Vector3d::UnitX());
    topic.columns["q[0]"].push_back(q.w());
    topic.columns["q[1]"].push_back(q.x());
    topic.columns["q[2]"].push_back(q.y());
    topic.columns["q[3]"].push_back(q.z());
  }
  out.topics.push_back(std::move(topic));
}

/// The position controller's target: north, east and down are three messages, written one after the other.
void set_points(const TopicLog& log, TopicLog& out) {
  const auto* north = log.find("PSCN");
  if (!north) return;
  TopicLog::Topic topic{"trajectory_setpoint", 0, {}, {}};
  const std::pair<const TopicLog::Topic*, const char*> axes[] = {
      {north, "TPN"}, {log.find("PSCE"), "TPE"}, {log.find("PSCD"), "TPD"}};
  for (const auto& [axis, target] : axes)
    if (!axis || !axis->columns.contains(target)) return;
  for (const double t : north->t_s) {
    std::array<double, 3> position{};
    bool whole = true;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto next = std::ranges::lower_bound(axes[i].first->t_s, t);
      whole = whole && next != axes[i].first->t_s.end();
      if (whole)
        position[i] =
            axes[i].first->columns.at(axes[i].second)[static_cast<std::size_t>(next - axes[i].first->t_s.begin())];
    }
    if (!whole) break;
    topic.t_s.push_back(t);
    for (std::size_t i = 0; i < 3; ++i) topic.columns["position[" + std::to_string(i) + "]"].push_back(position[i]);
  }
  out.topics.push_back(std::move(topic));
}

}  // namespace

TopicLog px4_names(const TopicLog& dataflash) {
  TopicLog out;
  out.loss = dataflash.loss;
  out.parameters = dataflash.parameters;
  out.texts = dataflash.texts;
  const std::string ekf = estimator(dataflash);
  const unsigned core = core_in_use(dataflash, ekf);
  translate(message_of(dataflash, ekf, 1, core), "vehicle_local_position",
            {{"x", "PN"}, {"y", "PE"}, {"z", "PD"}, {"vx", "VN"}, {"vy", "VE"}, {"vz", "VD"}}, out);
  validity(message_of(dataflash, ekf, 4, core), out);
  attitude(dataflash, out);
  translate(dataflash.find("IMU"), "vehicle_acceleration", {{"xyz[0]", "AccX"}, {"xyz[1]", "AccY"}, {"xyz[2]", "AccZ"}},
            out);
  set_points(dataflash, out);
  for (const char* battery : {"BAT", "CURR"})  // CURR: to Copter 3.6
    translate(dataflash.find(battery), "battery_status", {{"voltage_v", "Volt"}}, out);
  translate(dataflash.find("RCOU"), "actuator_outputs",
            {{"output[0]", "C1"}, {"output[1]", "C2"}, {"output[2]", "C3"}, {"output[3]", "C4"}}, out);
  translate(dataflash.find("CTUN"), "vehicle_thrust_setpoint", {{"xyz[2]", "ThO", -1}}, out);
  return out;
}

tl::expected<FlightLog, LogError> read_dataflash(const std::string& path) {
  return read_topics(path, "a .bin file of ArduPilot", [](std::span<const std::uint8_t> bytes) {
    return decode_dataflash(bytes).and_then([](const TopicLog& log) -> tl::expected<TopicLog, std::string> {
      TopicLog flight = px4_names(log);
      if (!flight.find("vehicle_local_position"))
        return tl::unexpected<std::string>(
            "no positions of the estimator (XKF1 or NKF1: PN, PE, PD); LOG_BITMASK needs its attitude bit");
      return flight;
    });
  });
}

}  // namespace backwash::log

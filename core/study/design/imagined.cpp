// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/design/imagined.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/study/design/design_rules.hpp"
#include "core/study/effects/on_the_model.hpp"
#include "core/study/windows/observer.hpp"
#include "core/types/quantile.hpp"
#include "core/types/thrust.hpp"

namespace backwash::study {
namespace {

void put(log::FlightLog& log, const std::string& prefix, const std::string& unit, const Vec3& x) {
  log.columns[prefix + "x" + unit].push_back(x.x());
  log.columns[prefix + "y" + unit].push_back(x.y());
  log.columns[prefix + "z" + unit].push_back(x.z());
}

log::FlightLog commanded(const std::vector<Setpoint>& commands) {
  log::FlightLog log;
  for (std::size_t k = 0; k < commands.size(); ++k) {
    const Setpoint& c = commands[k];
    log.t_s.push_back(static_cast<double>(k) * kControlPeriod);
    put(log, "", "_m", c.p_W);
    put(log, "cmd_", "_m", c.p_W);
    put(log, "cmd_v", "_mps", c.v_W);
    put(log, "cmd_a", "_mps2", c.a_W);
  }
  return log;
}

/// Attitude and thrust with which the craft accelerates so, at a heading.
void put_thrust(log::FlightLog& log, const Vec3& acceleration_W, double yaw, const Vehicle& vehicle) {
  const Vec3 thrust = acceleration_W + kGravity * Vec3::UnitZ(), z = thrust.normalized();
  const Vec3 x = Vec3(-std::sin(yaw), std::cos(yaw), 0).cross(z).normalized();
  Mat3 R_WB;
  R_WB << x, z.cross(x), z;
  const Eigen::Quaterniond q(R_WB);
  log.columns["qw"].push_back(q.w());
  log.columns["qx"].push_back(q.x());
  log.columns["qy"].push_back(q.y());
  log.columns["qz"].push_back(q.z());
  const double share = thrust.norm() * vehicle.body.mass / vehicle.propulsion.max_thrust;
  log.columns["thrust"].push_back(thrust_command(vehicle, share));
}

/// Mean by weight of a flown channel, and the median weight of its windows; zeros where nothing was measured.
std::pair<double, double> typical(const Observations& flown, std::size_t channel) {
  double sum = 0, weight = 0;
  std::vector<double> weights;
  for (std::size_t i = 0; i < flown.windows.size(); ++i) {
    const double w = flown.weight[channel][i];
    if (!(w > 0)) continue;
    sum += w * flown.y[channel][i];
    weight += w;
    weights.push_back(w);
  }
  if (weights.empty()) return {0, 0};
  return {sum / weight, quantile(std::move(weights), 0.5)};
}

double longest(const Observations& flown) {
  double t = 0;
  for (const auto& w : flown.windows) t = std::max(t, w.t);
  return t;
}

}  // namespace

Imagination::Imagination(const Observations& flown, const Vehicle& vehicle, MapView& surroundings)
    : flown_(&flown), vehicle_(vehicle), surroundings_(&surroundings) {}

std::optional<double> Imagination::first_voltage(bool used_battery) const {
  if (!flown_->has(Source::battery)) return std::nullopt;
  const Course course = mean_course(*flown_, &WindowRow::voltage);
  return course.first + (used_battery ? course.rate * longest(*flown_) : 0);
}

Observations Imagination::windows(const std::vector<Setpoint>& commands, bool used_battery) const {
  log::FlightLog log = commanded(commands);
  const Series nominal = series_of(log, vehicle_);
  const bool attitude = flown_->has(Source::thrust) && flown_->has(Source::attitude);
  const Course volts = mean_course(*flown_, &WindowRow::voltage),
               warmth = mean_course(*flown_, &WindowRow::temperature);
  for (const char* name : {"x_m", "y_m", "z_m"}) log.columns[name].clear();
  for (std::size_t k = 0; k < nominal.size(); ++k) {
    const double sign = k % 2 == 0 ? 1 : -1;
    put(log, "", "_m", nominal.p_nominal[k] + sign * kDesignRules.design_jitter * Vec3::Ones());
    put(log, "v", "_mps", nominal.v_nominal[k]);
    put(log, "a", "_mps2", nominal.a_nominal[k]);
    if (attitude) put_thrust(log, nominal.a_nominal[k], commands[k].yaw, vehicle_);
    if (flown_->has(Source::battery))
      log.columns["battery_v"].push_back(*first_voltage(used_battery) + volts.rate * nominal.t[k]);
    if (flown_->has(Source::temperature))
      log.columns["temperature_c"].push_back(warmth.first + warmth.rate * nominal.t[k]);
  }
  Observer observer(vehicle_, *surroundings_);
  observer.add(log);
  Observations seen = observer.finish();
  seen.missing = flown_->missing;
  for (std::size_t c = 0; c < kChannels; ++c) {
    const auto [level, weight] = typical(*flown_, c);
    for (std::size_t i = 0; i < seen.windows.size(); ++i) {
      const bool variance = c == kVarX || c == kVarY || c == kVarZ;
      seen.y[c][i] = variance ? level : 0;
      if (variance) seen.weight[c][i] = weight;
      if (!(weight > 0)) seen.weight[c][i] = 0;
    }
  }
  return seen;
}

}  // namespace backwash::study

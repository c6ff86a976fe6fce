// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/loop.hpp"

#include <algorithm>
#include <cmath>

#include "core/log/columns/log_columns.hpp"
#include "core/study/windows/gates/window_rules.hpp"

namespace backwash::study {

std::vector<Vec3> vectors(const log::FlightLog& log, const std::vector<std::size_t>& rows, const std::string& prefix,
                          const std::string& unit) {
  std::vector<Vec3> out;
  out.reserve(rows.size());
  const auto &x = log.column(prefix + "x" + unit), &y = log.column(prefix + "y" + unit),
             &z = log.column(prefix + "z" + unit);
  for (const auto i : rows) out.emplace_back(x[i], y[i], z[i]);
  return out;
}

Commands commands_of(const log::FlightLog& log, const std::vector<std::size_t>& rows) {
  const auto or_rest = [&](const char* prefix, const char* unit) {
    return has_xyz(log, prefix, unit) ? vectors(log, rows, prefix, unit) : std::vector<Vec3>(rows.size(), Vec3::Zero());
  };
  return {vectors(log, rows, "cmd_", "_m"), or_rest("cmd_v", "_mps"), or_rest("cmd_a", "_mps2")};
}

LoopMotion loop_of(const Series& s, const Commands& cmd, const Vehicle& vehicle, bool closed, double drag) {
  const auto& c = vehicle.controller;
  const Vec3 kp(c.kp.horizontal, c.kp.horizontal, c.kp.vertical), kd(c.kd.horizontal, c.kd.horizontal, c.kd.vertical);
  LoopMotion out;
  Vec3 p = cmd.p.front(), v = Vec3::Zero(), produced = Vec3::Zero();
  std::size_t heard = 0, felt = 0;
  // A command acts from some time in the period before its row on (held) or all along it (streamed): a quarter between.
  const double period = s.t.back() / static_cast<double>(s.size() - 1),
               age = c.latency + kWindowRules.command_age * period;
  const auto at_time = [&](const std::vector<Vec3>& x, double t) -> Vec3 {
    if (heard + 1 >= s.size() || s.t[heard + 1] - s.t[heard] > kWindowRules.held) return x[heard];
    const double share = std::clamp((t - s.t[heard]) / (s.t[heard + 1] - s.t[heard]), 0.0, 1.0);
    return x[heard] + share * (x[heard + 1] - x[heard]);
  };
  for (std::size_t i = 0; i < s.size(); ++i) {
    const double dt = i > 0 ? s.t[i] - s.t[i - 1] : 0;
    const bool gap = dt > kWindowRules.restart;
    if (gap) p = s.p[i], v = s.v[i];  // start again where the vehicle is
    const int steps = gap ? 1 : std::max(1, static_cast<int>(std::ceil(dt / kWindowRules.loop_step)));
    for (int k = 0; k < steps; ++k) {
      const double h = gap ? 0 : dt / steps, now = s.t[i] - dt + (k + 1) * h;
      while (heard + 1 < s.size() && s.t[heard + 1] <= now - age + kWindowRules.stamp_error) ++heard;
      while (felt + 1 < s.size() && s.t[felt + 1] <= now - c.feedback_delay + kWindowRules.stamp_error) ++felt;
      const Vec3 at = closed ? p : s.p[felt], moving = closed ? v : s.v[felt];
      const double sent = now - age;
      const Vec3 wanted = at_time(cmd.a, sent) + kp.cwiseProduct(at_time(cmd.p, sent) - at) +
                          kd.cwiseProduct(at_time(cmd.v, sent) - moving);
      const double rate = c.attitude_lag > 0 ? 1 - std::exp(-h / c.attitude_lag) : 1;
      produced += rate * (wanted - produced);
      v += h * (produced - drag * Vec3(v.x(), v.y(), 0));
      p += h * v;
    }
    out.p.push_back(p), out.v.push_back(v), out.a.push_back(produced);
  }
  return out;
}

std::vector<std::vector<Vec3>> answers(const Series& s, const Commands& cmd, const Vehicle& vehicle,
                                       std::span<const double> lags) {
  const auto& c = vehicle.controller;
  const Vec3 kp(c.kp.horizontal, c.kp.horizontal, c.kp.vertical), kd(c.kd.horizontal, c.kd.horizontal, c.kd.vertical);
  std::vector<std::vector<Vec3>> out(lags.size());
  std::vector<Vec3> r(lags.size(), Vec3::Zero());
  std::size_t at = 0;
  const auto between = [&](const std::vector<Vec3>& x, double t) -> Vec3 {
    while (at > 0 && s.t[at] > t) --at;
    while (at + 2 < s.size() && s.t[at + 1] <= t) ++at;
    const double share = std::clamp((t - s.t[at]) / (s.t[at + 1] - s.t[at]), 0.0, 1.0);
    return x[at] + share * (x[at + 1] - x[at]);
  };
  for (std::size_t i = 0; i < s.size(); ++i) {
    const double dt = i > 0 ? s.t[i] - s.t[i - 1] : 0;
    const int steps =
        dt > kWindowRules.restart ? 1 : std::max(1, static_cast<int>(std::ceil(dt / kWindowRules.loop_step)));
    for (int k = 0; k < steps; ++k) {
      const double now = s.t[i] - dt + (k + 0.5) * dt / steps, sent = now - c.latency, felt = now - c.feedback_delay;
      const Vec3 wanted = between(cmd.a, sent) + kp.cwiseProduct(between(cmd.p, sent) - between(s.p, felt)) +
                          kd.cwiseProduct(between(cmd.v, sent) - between(s.v, felt));
      for (std::size_t n = 0; n < lags.size(); ++n)
        r[n] += (1 - std::exp(-dt / steps / std::max<double>(kWindowRules.least_lag, lags[n]))) * (wanted - r[n]);
    }
    for (std::size_t n = 0; n < lags.size(); ++n) out[n].push_back(r[n]);
  }
  return out;
}

}  // namespace backwash::study

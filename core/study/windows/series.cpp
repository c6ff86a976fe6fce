// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/series.hpp"

#include <algorithm>
#include <cmath>

#include "core/log/log_columns.hpp"
#include "core/study/windows/window_rules.hpp"

namespace backwash::study {
namespace {

using RowNumbers = std::vector<std::size_t>;

std::vector<Vec3> vectors(const log::FlightLog& log, const RowNumbers& rows, const char* prefix, const char* unit) {
  std::vector<Vec3> out;
  out.reserve(rows.size());
  const std::string name(prefix);
  const auto &x = log.column(name + "x" + unit), &y = log.column(name + "y" + unit), &z = log.column(name + "z" + unit);
  for (const auto i : rows) out.emplace_back(x[i], y[i], z[i]);
  return out;
}

/// Slope of the parabola through a sample and its neighbours `reach` rows away.
std::vector<Vec3> derivative(const std::vector<double>& t, const std::vector<Vec3>& x, std::size_t reach) {
  std::vector<Vec3> d(x.size(), Vec3::Zero());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::size_t a = i >= reach ? i - reach : 0, b = std::min(x.size() - 1, i + reach);
    if (t[b] > t[a]) d[i] = (x[b] - x[a]) / (t[b] - t[a]);
  }
  return d;
}

/// The set-points of a flight: absent velocities and accelerations are zero (docs/interfaces.md).
struct Commands {
  std::vector<Vec3> p, v, a;
};

Commands commands_of(const log::FlightLog& log, const RowNumbers& rows) {
  const auto or_rest = [&](const char* prefix, const char* unit) {
    return has_xyz(log, prefix, unit) ? vectors(log, rows, prefix, unit) : std::vector<Vec3>(rows.size(), Vec3::Zero());
  };
  return {vectors(log, rows, "cmd_", "_m"), or_rest("cmd_v", "_mps"), or_rest("cmd_a", "_mps2")};
}

struct Loop {
  std::vector<Vec3> p, v, a;
};

/// The controller's loop at each row: fed with the logged state, or (`closed`) with its own.
Loop loop_of(const Series& s, const Commands& cmd, const Vehicle& vehicle, bool closed, double drag = 0) {
  const auto& c = vehicle.controller;
  const Vec3 kp(c.kp.horizontal, c.kp.horizontal, c.kp.vertical), kd(c.kd.horizontal, c.kd.horizontal, c.kd.vertical);
  Loop out;
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

/// The loop's answer to the logged state, joined between rows as the controller saw it, at each lag of kShifts.
std::array<std::vector<Vec3>, kShifts.size()> answers(const Series& s, const Commands& cmd, const Vehicle& vehicle) {
  const auto& c = vehicle.controller;
  const Vec3 kp(c.kp.horizontal, c.kp.horizontal, c.kp.vertical), kd(c.kd.horizontal, c.kd.horizontal, c.kd.vertical);
  std::array<std::vector<Vec3>, kShifts.size()> out;
  std::array<Vec3, kShifts.size()> r;
  r.fill(Vec3::Zero());
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
      for (std::size_t n = 0; n < kShifts.size(); ++n)
        r[n] += (1 - std::exp(-dt / steps / std::max<double>(kWindowRules.least_lag, c.attitude_lag + kShifts[n]))) *
                (wanted - r[n]);
    }
    for (std::size_t n = 0; n < kShifts.size(); ++n) out[n].push_back(r[n]);
  }
  return out;
}

/// Whether the craft flew where its set-points are, or where the loop would have led it, in half of the rows at least.
/// Zeros beside commanded velocities, or positions of another frame, are no set-points that a loop has heard.
bool follows(const Series& s, const Commands& cmd, const Loop& nominal, const Vehicle& vehicle) {
  const double sunk = kWindowRules.stray + kWindowRules.sunk * kGravity / vehicle.controller.kp.vertical;
  std::size_t far = 0;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const auto near = [&](const Vec3& p_W) {
      const Vec3 off = s.p[i] - p_W;
      return off.head<2>().norm() <= kWindowRules.stray && std::abs(off.z()) <= sunk;
    };
    far += near(cmd.p[i]) || near(nominal.p[i]) ? 0u : 1u;
  }
  return 2 * far <= s.size();
}

RowNumbers rising_rows(const std::vector<double>& t) {
  RowNumbers rows;
  for (std::size_t i = 0; i < t.size(); ++i)
    if (rows.empty() || t[i] > t[rows.back()]) rows.push_back(i);
  return rows;
}

void read_motion(Series& s, const log::FlightLog& log, const RowNumbers& rows) {
  s.p = vectors(log, rows, "", "_m");
  s.has_velocity = has_xyz(log, "v", "_mps");
  s.has_acceleration = has_xyz(log, "a", "_mps2");
  const double rate = s.size() > 1 ? static_cast<double>(s.size() - 1) / (s.t.back() - s.t.front()) : 1;
  const auto reach = [&](double seconds) {
    return static_cast<std::size_t>(std::lround(std::clamp(seconds * rate / 2, 1.0, kWindowRules.slope_rows.value)));
  };
  s.v = s.has_velocity ? vectors(log, rows, "v", "_mps") : derivative(s.t, s.p, reach(kWindowRules.slope_time));
  s.a = s.has_acceleration ? vectors(log, rows, "a", "_mps2") : derivative(s.t, s.v, reach(kWindowRules.slope_time));
}

void read_attitude(Series& s, const log::FlightLog& log, const RowNumbers& rows) {
  const auto &w = log.column("qw"), &x = log.column("qx"), &y = log.column("qy"), &z = log.column("qz");
  for (const auto i : rows) {
    Eigen::Quaterniond q(w[i], x[i], y[i], z[i]);
    s.R_WB.push_back(q.norm() > kWindowRules.no_attitude ? q.normalized().toRotationMatrix() : Mat3(Mat3::Identity()));
  }
}

/// What the set-points lead to, unless the craft flew elsewhere.
void read_commands(Series& s, const Commands& cmd, const Vehicle& vehicle) {
  Loop nominal = loop_of(s, cmd, vehicle, true);
  s.strayed = !follows(s, cmd, nominal, vehicle);
  if (s.strayed) return;
  if (!s.simulated_by_thrust) s.a_sim = loop_of(s, cmd, vehicle, false).a;
  Vehicle lagging = vehicle;
  lagging.controller.attitude_lag += kWindowRules.more_lag;
  s.a_lagging = loop_of(s, cmd, lagging, true).a;
  s.v_dragged = loop_of(s, cmd, vehicle, true, kWindowRules.loop_drag).v;
  if (s.simulated_by_thrust) s.answer = answers(s, cmd, vehicle);
  s.p_nominal = std::move(nominal.p), s.v_nominal = std::move(nominal.v), s.a_nominal = std::move(nominal.a);
}

}  // namespace

std::optional<int> segment_of(double logged) {
  const auto number = static_cast<int>(std::lround(std::clamp(logged, -1.0, kWindowRules.segments.value)));
  return number >= 0 ? std::optional(number) : std::nullopt;
}

Series series_of(const log::FlightLog& log, const Vehicle& vehicle) {
  Series s;
  const RowNumbers rows = rising_rows(log.t_s);
  for (const auto i : rows) s.t.push_back(log.t_s[i] - log.t_s[rows.front()]);
  s.row = rows;
  if (s.size() < 2) return s;
  read_motion(s, log, rows);
  if (log.has("qw") && log.has("qx") && log.has("qy") && log.has("qz")) read_attitude(s, log, rows);
  if (log.has("thrust")) {
    const auto& u = log.column("thrust");
    for (const auto i : rows)
      s.thrust_acc.push_back(vehicle.propulsion.max_thrust / vehicle.body.mass * thrust_share(vehicle, u[i]));
  }
  s.segment.resize(s.size());
  if (log.has("segment"))
    for (std::size_t k = 0; k < rows.size(); ++k) s.segment[k] = segment_of(log.column("segment")[rows[k]]);
  s.simulated_by_thrust = !s.thrust_acc.empty() && !s.R_WB.empty();
  const bool commanded = has_xyz(log, "cmd_", "_m");
  if (s.simulated_by_thrust) {
    for (std::size_t i = 0; i < s.size(); ++i)
      s.a_sim.push_back(s.R_WB[i].col(2) * s.thrust_acc[i] - kGravity * Vec3::UnitZ());
  }
  if (commanded) read_commands(s, commands_of(log, rows), vehicle);
  if (s.a_sim.empty()) s.a_sim.assign(s.size(), Vec3::Zero());
  return s;
}

}  // namespace backwash::study

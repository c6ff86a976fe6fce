// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/signals/series.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/log/columns/log_columns.hpp"
#include "core/study/windows/gates/window_rules.hpp"
#include "core/study/windows/loop.hpp"

namespace backwash::study {
namespace {

using RowNumbers = std::vector<std::size_t>;

/// Slope of the parabola through a sample and its neighbours `reach` rows away.
std::vector<Vec3> derivative(const std::vector<double>& t, const std::vector<Vec3>& x, std::size_t reach) {
  std::vector<Vec3> d(x.size(), Vec3::Zero());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::size_t a = i >= reach ? i - reach : 0, b = std::min(x.size() - 1, i + reach);
    if (t[b] > t[a]) d[i] = (x[b] - x[a]) / (t[b] - t[a]);
  }
  return d;
}

/// Whether the craft flew where its set-points are, or where the loop would have led it, in half of the rows at least.
/// Zeros beside commanded velocities, or positions of another frame, are no set-points that a loop has heard.
bool follows(const Series& s, std::span<const Setpoint> commands, const LoopMotion& nominal, const Vehicle& vehicle) {
  const double sunk = kWindowRules.stray + kWindowRules.sunk * kGravity / vehicle.controller.kp.vertical;
  std::size_t far = 0;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const auto near = [&](const Vec3& p_W) {
      const Vec3 off = s.p[i] - p_W;
      return off.head<2>().norm() <= kWindowRules.stray && std::abs(off.z()) <= sunk;
    };
    far += near(commands[i].p_W) || near(nominal.p[i]) ? 0u : 1u;
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
void read_commands(Series& s, std::span<const Setpoint> commands, const Vehicle& vehicle) {
  const Flown flown{s.t, s.p, s.v, commands};
  const auto loop = with_command_age(loop::PositionLoop(vehicle), s.t);
  LoopMotion nominal = loop_of(flown, loop);
  s.strayed = !follows(s, commands, nominal, vehicle);
  if (s.strayed) return;
  if (!s.simulated_by_thrust) s.a_sim = answers(flown, loop, std::array{loop.attitude_lag}).front();
  loop::PositionLoop lagging = loop;
  lagging.attitude_lag += kWindowRules.more_lag;
  s.a_lagging = loop_of(flown, lagging).a;
  LoopMotion dragged = loop_of(flown, loop, kWindowRules.loop_drag);
  for (std::size_t i = 0; i < s.size(); ++i) dragged.a[i].head<2>() -= kWindowRules.loop_drag * dragged.v[i].head<2>();
  s.v_dragged = std::move(dragged.v);
  s.a_dragged = std::move(dragged.a);
  if (s.simulated_by_thrust) {
    std::array<double, kShifts.size()> lags;
    for (std::size_t n = 0; n < lags.size(); ++n) lags[n] = loop.attitude_lag + kShifts[n];
    auto found = answers(flown, loop, lags);
    std::ranges::move(found, s.answer.begin());
  }
  s.p_nominal = std::move(nominal.p);
  s.v_nominal = std::move(nominal.v);
  s.a_nominal = std::move(nominal.a);
}

}  // namespace

std::optional<int> segment_of(double logged) {
  const auto number =
      static_cast<int>(std::lround(std::clamp(logged, -1.0, static_cast<double>(std::numeric_limits<int>::max()))));
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

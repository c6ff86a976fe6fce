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

std::vector<Setpoint> commands_of(const log::FlightLog& log, const std::vector<std::size_t>& rows) {
  const auto or_rest = [&](const char* prefix, const char* unit) {
    return has_xyz(log, prefix, unit) ? vectors(log, rows, prefix, unit) : std::vector<Vec3>(rows.size(), Vec3::Zero());
  };
  const auto p = vectors(log, rows, "cmd_", "_m"), v = or_rest("cmd_v", "_mps"), a = or_rest("cmd_a", "_mps2");
  std::vector<Setpoint> commands;
  for (std::size_t k = 0; k < rows.size(); ++k) commands.push_back({p[k], v[k], a[k]});
  return commands;
}

namespace {

/// A time within the rows of a log, near the one before. Rows are joined by lines, but set-points of rows farther apart
/// than `held` are held.
class Place {
 public:
  explicit Place(const Flown& log, double held = kWindowRules.held) : log_(log), held_(held) {}
  Place& at(double t) {
    const auto& rows = log_.t;
    while (row_ > 0 && rows[row_] > t + kWindowRules.stamp_error) --row_;
    while (row_ + 2 < rows.size() && rows[row_ + 1] <= t + kWindowRules.stamp_error) ++row_;
    share_ = std::clamp((t - rows[row_]) / (rows[row_ + 1] - rows[row_]), 0.0, 1.0);
    return *this;
  }
  State state() const { return {between(log_.p[row_], log_.p[row_ + 1]), between(log_.v[row_], log_.v[row_ + 1])}; }
  Setpoint command() const {
    const Setpoint &a = log_.commands[row_], &b = log_.commands[row_ + 1];
    if (share_ < 1 && log_.t[row_ + 1] - log_.t[row_] > held_) return a;
    return {between(a.p_W, b.p_W), between(a.v_W, b.v_W), between(a.a_W, b.a_W)};
  }

 private:
  Vec3 between(const Vec3& a, const Vec3& b) const { return a + share_ * (b - a); }

  const Flown& log_;
  const double held_;
  std::size_t row_ = 0;
  double share_ = 0;
};

/// Pieces of the time between two rows; one after a gap.
int pieces(double dt) {
  if (dt > 2 * kWindowRules.held) return 1;
  return std::max(1, static_cast<int>(std::ceil(dt / kWindowRules.loop_step)));
}

}  // namespace

loop::PositionLoop with_command_age(loop::PositionLoop loop, std::span<const double> t) {
  loop.latency += kWindowRules.command_age * ((t.back() - t.front()) / static_cast<double>(t.size() - 1));
  return loop;
}

LoopMotion loop_of(const Flown& log, const loop::PositionLoop& loop, double drag) {
  LoopMotion out;
  Place place(log);
  State now{log.commands.front().p_W, Vec3::Zero()};
  Vec3 a = Vec3::Zero();
  for (std::size_t i = 0; i < log.t.size(); ++i) {
    const double dt = i > 0 ? log.t[i] - log.t[i - 1] : 0;
    const bool gap = dt > 2 * kWindowRules.held;
    if (gap) now = {log.p[i], log.v[i]};
    for (int k = 0; k < pieces(dt); ++k) {
      const double h = gap ? 0 : dt / pieces(dt), middle = log.t[i] - dt + (k + 0.5) * h;
      const auto rate = [&](const Vec3& by_rotors, const Vec3& v) -> Vec3 {
        return by_rotors - drag * Vec3(v.x(), v.y(), 0);
      };
      const Vec3 v = now.v_W + h / 2 * rate(a, now.v_W);
      const Vec3 u = loop.asked(place.at(middle - loop.latency).command(), {now.p_W + h / 2 * now.v_W, v});
      const Vec3 before = loop.attitude_lag > 0 ? a : u;
      a = loop.after(a, u, h);
      now.p_W += h * v;
      now.v_W += h * rate((before + a) / 2, v);
    }
    out.p.push_back(now.p_W);
    out.v.push_back(now.v_W);
    out.a.push_back(a);
  }
  return out;
}

std::vector<std::vector<Vec3>> answers(const Flown& log, const loop::PositionLoop& loop, std::span<const double> lags) {
  Place place(log, HUGE_VAL);
  const auto asked = [&](double now) {
    const Setpoint command = place.at(now - loop.latency).command();
    return loop.asked(command, place.at(now - loop.feedback_delay).state());
  };
  std::vector<loop::PositionLoop> loops(lags.size(), loop);
  for (std::size_t n = 0; n < lags.size(); ++n)
    loops[n].attitude_lag = std::max<double>(kWindowRules.least_lag, lags[n]);
  std::vector<std::vector<Vec3>> out(lags.size());
  std::vector<Vec3> r(lags.size());
  for (std::size_t i = 0; i < log.t.size(); ++i) {
    const double dt = i > 0 ? log.t[i] - log.t[i - 1] : 0, h = dt / pieces(dt);
    const bool begins = i == 0 || dt > 2 * kWindowRules.held;
    if (begins) std::ranges::fill(r, asked(log.t[i]));
    for (int k = 0; k < pieces(dt) && !begins; ++k) {
      const Vec3 u = asked(log.t[i] - dt + (k + 0.5) * h);
      for (std::size_t n = 0; n < lags.size(); ++n) r[n] = loops[n].after(r[n], u, h);
    }
    for (std::size_t n = 0; n < lags.size(); ++n) out[n].push_back(r[n]);
  }
  return out;
}

}  // namespace backwash::study

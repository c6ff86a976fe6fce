// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/signals/delays.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

namespace backwash::study {
namespace {

/// Nominal acceleration `shift` before a sample.
double earlier(const Series& s, std::size_t i, double shift, int axis) {
  const double at = s.t[i] - shift;
  std::size_t k = std::max<std::size_t>(i, 1);
  while (k > 1 && s.t[k - 1] > at) --k;
  while (k + 1 < s.size() && s.t[k] < at) ++k;
  const double share = std::clamp((at - s.t[k - 1]) / (s.t[k] - s.t[k - 1]), 0.0, 1.0);
  return s.a_nominal[k - 1][axis] + share * (s.a_nominal[k][axis] - s.a_nominal[k - 1][axis]);
}

/// Slope of a value over a sample's neighbours.
template <typename F>
auto slope_at(const Series& s, F value) {
  return [&s, value](std::size_t i) {
    const std::size_t a = i > 0 ? i - 1 : 0, b = std::min(i + 1, s.size() - 1);
    return (value(b) - value(a)) / (s.t[b] - s.t[a]);
  };
}

/// Values without their mean.
template <typename F>
std::vector<double> about_mean(SampleRange w, F value) {
  std::vector<double> x;
  for (std::size_t i = w.begin; i < w.end; ++i) x.push_back(value(i));
  const double mean = std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
  for (double& v : x) v -= mean;
  return x;
}

/// Thrust per mass beyond a hover's that the set-points ask for, m/s²: of a fast flight the tilt alone takes some.
double asked_thrust(const Series& s, std::size_t i) {
  return (s.a_nominal[i] + kGravity * Vec3::UnitZ()).norm() - kGravity;
}

/// How much of it acts upwards.
double asked_up(const Series& s, std::size_t i) {
  const Vec3 f = s.a_nominal[i] + kGravity * Vec3::UnitZ();
  return asked_thrust(s, i) * f.z() / std::max(f.norm(), kWindowRules.no_attitude.value);
}

/// What a window says of a delay: its value, its design, and those of a longer lag of the attitude and of a drag, each
/// over √Σx².
struct Late {
  double y;
  DelayStage::PerSecond design;
  double lagging = 0, dragged = 0;
};

/// How late the attitude follows what the loop asks of it, in hover: there the loop answers gusts alone, by the
/// measured state, and set-points that act late change nothing. Slow answers alone count: there a loop of any order
/// with the same mean lateness follows alike, and at 10 rad/s one of second order is 30 ms later than one of first.
std::optional<Late> tilt_delay(const Series& s, SampleRange w) {
  double y = 0, square = 0;
  DelayStage::PerSecond design{};
  constexpr std::size_t kOwn = 2;  // of kShifts
  for (int axis = 0; axis < 2; ++axis) {
    const auto nominal = [&s, axis](std::size_t i) { return s.a_nominal[i][axis]; };
    if (Moment(rates(s, w, nominal)).excited(kWindowRules.excited_rate)) return std::nullopt;
    const auto answer = [&s, axis](std::size_t i) { return s.answer[kOwn][i][axis]; };
    const Moment m(slow(s, w, rates(s, w, answer), kWindowRules.slow_tilt));
    if (!m.excited(kWindowRules.excited_rate)) continue;
    const double norm = std::sqrt(m.square);
    y -= norm * m.with(detrended_values(w, [&](std::size_t i) { return s.a_sim[i][axis] - answer(i); }));
    square += m.square;
    for (std::size_t k = 0; k < kShifts.size(); ++k) {
      if (k == kOwn) continue;
      const auto later = [&](std::size_t i) { return s.answer[k][i][axis] - answer(i); };
      design[k] += -norm * m.with(detrended_values(w, later)) / kShifts[k];
    }
  }
  if (!(square > 0)) return std::nullopt;
  design[kOwn] = 0.5 * (design[kOwn - 1] + design[kOwn + 1]);
  for (double& g : design) g /= std::sqrt(square);
  return Late{y / std::sqrt(square), design};
}

/// How late set-points act, of axes `from` … `to` − 1, along the nominal rate of each.
std::optional<Late> command_delay(const Series& s, SampleRange w, int from, int to) {
  double y = 0, square = 0, lagging = 0, dragged = 0;
  DelayStage::PerSecond design{};
  for (int axis = from; axis < to; ++axis) {
    const auto nominal = [&s, axis](std::size_t i) { return s.a_nominal[i][axis]; };
    const Moment m(rates(s, w, nominal));
    if (!m.excited(kWindowRules.excited_rate)) continue;
    const double norm = std::sqrt(m.square);
    const auto later_by = [&](const std::vector<Vec3>& a) {
      return -norm * m.with(detrended_values(w, [&](std::size_t i) { return a[i][axis] - nominal(i); }));
    };
    y += later_by(s.a);
    square += m.square;
    lagging += later_by(s.a_lagging);
    dragged += later_by(s.a_dragged);
    for (std::size_t k = 0; k < kShifts.size(); ++k) {
      const auto later = [&](std::size_t i) { return earlier(s, i, kShifts[k], axis) - nominal(i); };
      design[k] += kShifts[k] != 0 ? -norm * m.with(detrended_values(w, later)) / kShifts[k] : m.square;
    }
  }
  if (!(square > 0)) return std::nullopt;
  for (double& d : design) d /= std::sqrt(square);
  return Late{y / std::sqrt(square), design, lagging / kWindowRules.more_lag / std::sqrt(square),
              dragged / kWindowRules.loop_drag / std::sqrt(square)};
}

}  // namespace

std::vector<ChannelValue> Delays::add(const Series& s, SampleRange w, std::size_t number, WindowRow& row) {
  std::vector<ChannelValue> values;
  const auto asked = [&s](std::size_t i) { return asked_thrust(s, i); };
  if (s.simulated_by_thrust) {
    // Instrument and design both come from the set-points alone: the logged thrust also answers the gusts, and a
    // design that shares their noise with the residual would be biased.
    // Their means alone are taken out: up and down once in 3 to 5 s, half of what was asked for is a window's trend.
    const auto r = about_mean(w, [&](std::size_t i) { return s.R_WB[i].col(2).dot(s.a[i] - s.a_sim[i]); });
    const auto rate = about_mean(w, slope_at(s, asked)), level = about_mean(w, asked);
    // A steeper curve adds a share of what was commanded; a first-order lag takes τ times the rate of what came of it.
    const auto flown = about_mean(w, [&](std::size_t i) { return s.thrust_acc[i]; });
    const auto along = [&](std::size_t i) { return s.R_WB[i].col(2).dot(s.a[i]); };
    const auto flown_rate = about_mean(w, slope_at(s, along));
    const Moment delay(rate), slope(level);
    ThrustMoments moments{number};
    for (std::size_t i = w.begin; i < w.end; ++i) moments.mean[0] += asked_up(s, i) / static_cast<double>(w.size());
    moments.mean[1] = (asked_up(s, w.end - 1) - asked_up(s, w.begin)) / (s.t[w.end - 1] - s.t[w.begin]);
    const bool late = delay.excited(kWindowRules.excited_rate), steep = slope.excited(kWindowRules.excited_level);
    if (late) {
      moments.delay = {delay.with(level), delay.with(rate)};
      row.delay_at = delay.at_points<kPoints>();
      values.push_back({kThrustDelay, delay.with(r), 1});
    }
    if (steep) {
      moments.slope = {slope.with(level), slope.with(rate)};
      row.slope_at = slope.at_points<kPoints>();
      values.push_back({kThrustSlope, slope.with(r), 1});
    }
    if (late || steep) {
      moments.stage.add({level, rate}, {flown, flown_rate});
      thrust.push_back(moments);
    }
  }
  for (std::size_t k = 0; k < command.size(); ++k)
    if (const auto late = k == 0 ? command_delay(s, w, 0, 2) : command_delay(s, w, 2, 3)) {
      values.push_back({kCommandDelayH + k, late->y, 1});
      row.lag_gain[k] = late->lagging;
      if (k == 0) row.drag_gain = late->dragged;
      command[k].add(number, late->y, late->design);
    }
  if (!s.simulated_by_thrust) return values;
  if (const auto late = tilt_delay(s, w)) {
    values.push_back({kTiltDelay, late->y, 1});
    tilt.add(number, late->y, late->design);
  }
  return values;
}

void Delays::add(const Delays& other, std::size_t first) {
  for (ThrustMoments moments : other.thrust) {
    moments.window += first;
    thrust.push_back(moments);
  }
  for (std::size_t k = 0; k < command.size(); ++k) command[k].add(other.command[k], first);
  tilt.add(other.tilt, first);
}

// Of (delay, slope): the moments with −ȧ and T/m − g as they follow z.
void Delays::settle(std::vector<WindowRow>& windows) const {
  FirstStage whole;
  for (const auto& moments : thrust) whole.add(moments.stage);
  const Eigen::Matrix2d follows = whole.coefficients();
  const auto design = [&](const std::array<double, 2>& moment) {
    const Eigen::RowVector2d flown = Eigen::RowVector2d(moment[0], moment[1]) * follows;
    return std::array<double, 2>{-flown[1], flown[0]};
  };
  for (const auto& [window, delay, slope, mean, own] : thrust) {
    WindowRow& row = windows[window];
    row.delay_gain = design(delay);
    row.slope_gain = design(slope);
    row.mean_gain = design(mean);
  }
  for (std::size_t k = 0; k < command.size(); ++k)
    for (const auto& [window, per_second] : command[k].designs()) windows[window].command_gain[k] = per_second;
  for (const auto& [window, per_second] : tilt.designs()) windows[window].tilt_gain = per_second;
}

}  // namespace backwash::study

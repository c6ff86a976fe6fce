// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "core/study/windows/observation.hpp"

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

}  // namespace

/// How late and how steeply thrust and commands act.
void Observer::put_delays(const Series& s, Stretch w) {
  const auto nominal = [&](int axis) { return [&s, axis](std::size_t i) { return s.a_nominal[i][axis]; }; };
  if (s.simulated_by_thrust) {
    // Instrument and design both come from the set-points alone: the logged thrust also answers the gusts, and a
    // design that shares their noise with the residual would be biased.
    const auto r = detrended_values(w, [&](std::size_t i) { return s.R_WB[i].col(2).dot(s.a[i] - s.a_sim[i]); });
    const auto rate = rates(s, w, nominal(2)), level = detrended_values(w, nominal(2));
    // A steeper curve adds a share of what was commanded; a first-order lag takes τ times the rate of what came of it.
    const auto flown = detrended_values(w, [&](std::size_t i) { return s.thrust_acc[i]; });
    const auto flown_rate = rates(s, w, [&](std::size_t i) { return s.R_WB[i].col(2).dot(s.a[i]); });
    const Moment delay(rate), slope(level);
    ThrustMoments moments{seen_.windows.size() - 1};
    const bool late = delay.excited(kWindowRules.excited_rate), steep = slope.excited(kWindowRules.excited_level);
    if (late) {
      moments.delay = {delay.with(level), delay.with(rate)};
      put(kThrustDelay, delay.with(r), 1);
    }
    if (steep) {
      moments.slope = {slope.with(level), slope.with(rate)};
      put(kThrustSlope, slope.with(r), 1);
    }
    if (late || steep) {
      thrust_stage_.add({level, rate}, {flown, flown_rate});
      thrust_moments_.push_back(moments);
    }
  }
  put_command_delay(s, w, 0, 2);
  put_command_delay(s, w, 2, 3);
}

/// Of axes `from` … `to` − 1, along the nominal rate of each.
void Observer::put_command_delay(const Series& s, Stretch w, int from, int to) {
  double y = 0, square = 0;
  DelayStage::PerSecond design{};
  for (int axis = from; axis < to; ++axis) {
    const auto nominal = [&s, axis](std::size_t i) { return s.a_nominal[i][axis]; };
    const Moment m(rates(s, w, nominal));
    if (!m.excited(kWindowRules.excited_rate)) continue;
    const double norm = std::sqrt(m.square);
    y -= norm * m.with(detrended_values(w, [&](std::size_t i) { return s.a[i][axis] - nominal(i); }));
    square += m.square;
    for (std::size_t k = 0; k < kShifts.size(); ++k) {
      const auto later = [&](std::size_t i) { return earlier(s, i, kShifts[k], axis) - nominal(i); };
      design[k] += kShifts[k] != 0 ? -norm * m.with(detrended_values(w, later)) / kShifts[k] : m.square;
    }
  }
  if (!(square > 0)) return;
  for (double& d : design) d /= std::sqrt(square);
  const std::size_t channel = from == 0 ? kCommandDelayH : kCommandDelayZ;
  put(channel, y / std::sqrt(square), 1);
  command_stage_[channel - kCommandDelayH].add(seen_.windows.size() - 1, y / std::sqrt(square), design);
}

void Observer::settle_commands() {
  for (std::size_t k = 0; k < command_stage_.size(); ++k)
    for (const auto& [window, design] : command_stage_[k].designs()) seen_.windows[window].command_gain[k] = design;
}

/// Designs of (delay, slope): the moments with −ȧ and T/m − g as they follow z.
void Observer::follow_thrust() {
  const Eigen::Matrix2d follows = thrust_stage_.coefficients();
  const auto design = [&](const std::array<double, 2>& moment) {
    const Eigen::RowVector2d flown = Eigen::RowVector2d(moment[0], moment[1]) * follows;
    return std::array<double, 2>{-flown[1], flown[0]};
  };
  for (const auto& [window, delay, slope] : thrust_moments_)
    seen_.windows[window].delay_gain = design(delay), seen_.windows[window].slope_gain = design(slope);
}

}  // namespace backwash::study

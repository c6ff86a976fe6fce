// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/support.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::reach {

namespace {
constexpr int kPhases = AxisResponse::kPhases;
}

SupportRecursion::SupportRecursion(const AxisResponse& horizontal, const AxisResponse& vertical, const Vehicle& vehicle)
    : horizontal_(&horizontal),
      vertical_(&vertical),
      position_(vehicle.initial_error.position),
      velocity_(vehicle.initial_error.velocity) {
  for (std::size_t d = 0; d < kDirections; ++d) history_[d].reserve(2 * response(d).S.size());
}

void SupportRecursion::step(const DisturbanceBound& w_bar) noexcept {
  for (std::size_t d = 0; d < kDirections; ++d) {
    const AxisResponse& axis = response(d);
    const double w = w_bar.w[d];
    now_[d] = later_[d][kPhases - 1] + w * axis.S[0][kPhases - 1];
    largest_[d] = std::max(largest_[d], w);

    std::vector<double>& history = history_[d];
    const std::size_t kept = axis.S.size() - 1;  // the step in progress is the N-th
    if (history.size() >= 2 * kept) {
      std::move(history.end() - static_cast<std::ptrdiff_t>(kept), history.end(), history.begin());
      history.resize(kept);
    }
    history.push_back(w);
    if (history.size() > kept) largest_dropped_[d] = std::max(largest_dropped_[d], history[history.size() - 1 - kept]);
    sum_history(d);
  }
  ++steps_;
}

void SupportRecursion::sum_history(std::size_t direction) noexcept {
  const AxisResponse& axis = response(direction);
  const std::vector<double>& history = history_[direction];
  const std::size_t used = std::min(history.size(), axis.S.size() - 1);
  std::array<double, kPhases> sum{};
  for (std::size_t age = 1; age <= used; ++age) {
    const double w = history[history.size() - age];
    for (int phase = 0; phase < kPhases; ++phase) sum[phase] += w * axis.S[age][phase];
  }
  for (double& s : sum) s += axis.tail * largest_dropped_[direction];
  later_[direction] = sum;
}

double SupportRecursion::initial(const AxisResponse& axis, int phase) const noexcept {
  const std::size_t m = steps_ * kPhases + static_cast<std::size_t>(phase);
  const bool known = m < axis.from_position.size();
  return std::hypot(position_ * (known ? axis.from_position[m] : axis.from_position_tail),
                    velocity_ * (known ? axis.from_velocity[m] : axis.from_velocity_tail));
}

PerDirection SupportRecursion::half_widths() const noexcept {
  PerDirection h;
  for (std::size_t d = 0; d < kDirections; ++d) h[d] = initial(response(d), 0) + now_[d];
  return h;
}

PerDirection SupportRecursion::half_widths_until_next(const DisturbanceBound& next) const noexcept {
  constexpr double kPhaseLength = kControlPeriod / kPhases;
  PerDirection h = half_widths();
  for (std::size_t d = 0; d < kDirections; ++d) {
    const AxisResponse& axis = response(d);
    for (int phase = 1; phase <= kPhases; ++phase)
      h[d] = std::max(h[d], initial(axis, phase) + later_[d][phase - 1] + next.w[d] * axis.S[0][phase - 1]);
    const double acceleration = axis.acceleration_inf * std::max(largest_[d], next.w[d]) +
                                axis.acceleration_from_position * position_ +
                                axis.acceleration_from_velocity * velocity_;
    h[d] += kPhaseLength * kPhaseLength / 8 * acceleration;
  }
  return h;
}

}  // namespace backwash::reach

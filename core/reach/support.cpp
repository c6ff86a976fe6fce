// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/support.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::reach {

template <std::size_t Lanes>
SupportGroup<Lanes>::SupportGroup(const AxisResponse& response, double position, double velocity)
    : response_(&response), position_(position), velocity_(velocity), filter_(response) {
  initial_[kPhases] = position_;
  look_up_initial(1);
}

template <std::size_t Lanes>
void SupportGroup<Lanes>::look_up_initial(std::size_t first) noexcept {
  using Phases = Eigen::Array<double, kPhases, 1>;
  const auto& r_p = response_->from_position;
  const auto& r_v = response_->from_velocity;
  if (first >= r_p.size() + 2UL * kPhases) return;  // all of them are the tails already
  Phases p, v;
  if (first + kPhases <= r_p.size()) {
    p = Eigen::Map<const Phases>(r_p.data() + first);
    v = Eigen::Map<const Phases>(r_v.data() + first);
  } else {
    for (std::size_t i = 0; i < kPhases; ++i) {
      const bool known = first + i < r_p.size();
      const auto row = static_cast<Eigen::Index>(i);
      p[row] = known ? r_p[first + i] : response_->from_position_tail;
      v[row] = known ? r_v[first + i] : response_->from_velocity_tail;
    }
  }
  initial_[0] = initial_[kPhases];
  Eigen::Map<Phases>(initial_.data() + 1) = ((position_ * p).square() + (velocity_ * v).square()).sqrt();
}

template <std::size_t Lanes>
void SupportGroup<Lanes>::step(const Row& w_bar) noexcept {
  const Row past = filter_.push(w_bar), tail = filter_.tail();
  for (std::size_t lane = 0; lane < Lanes; ++lane) {
    now_[lane] = later_[lane] + w_bar[lane] * response_->G[0];
    later_[lane] = past[lane] + tail[lane];
    bulge_[lane] = response_->chord_decay * bulge_[lane] + response_->chord_excess * w_bar[lane];
    largest_[lane] = std::max(largest_[lane], w_bar[lane]);
  }
  look_up_initial(++steps_ * kPhases + 1);
}

template <std::size_t Lanes>
typename SupportGroup<Lanes>::Row SupportGroup<Lanes>::half_widths() const noexcept {
  Row h;
  for (std::size_t lane = 0; lane < Lanes; ++lane) h[lane] = initial_[0] + now_[lane];
  return h;
}

template <std::size_t Lanes>
typename SupportGroup<Lanes>::Row SupportGroup<Lanes>::half_widths_until_next(const Row& next) const noexcept {
  Row h = half_widths();
  for (std::size_t phase = 1; phase <= kPhases; ++phase) {
    const double phi = static_cast<double>(phase) / kPhases, bow = 4 * phi * (1 - phi);
    for (std::size_t lane = 0; lane < Lanes; ++lane)
      h[lane] = std::max(h[lane], initial_[phase] + (1 - phi) * now_[lane] + phi * later_[lane] + bow * bulge_[lane] +
                                      next[lane] * response_->S[0][phase - 1]);
  }
  constexpr double kPhaseLength = kControlPeriod / kPhases;
  const double of_initial =
      response_->acceleration_from_position * position_ + response_->acceleration_from_velocity * velocity_;
  for (std::size_t lane = 0; lane < Lanes; ++lane)
    h[lane] += kPhaseLength * kPhaseLength / 8 *
               (response_->acceleration_inf * std::max(largest_[lane], next[lane]) + of_initial);
  return h;
}

template class SupportGroup<1>;
template class SupportGroup<4>;

namespace {

std::array<double, 4> horizontal(const DisturbanceBound& b) noexcept {
  return {b.w[kX], b.w[kY], b.w[kXyPlus], b.w[kXyMinus]};
}

PerDirection together(const std::array<double, 4>& h, const std::array<double, 1>& v) noexcept {
  PerDirection all;
  all[kX] = h[0];
  all[kY] = h[1];
  all[kXyPlus] = h[2];
  all[kXyMinus] = h[3];
  all[kZ] = v[0];
  return all;
}

}  // namespace

SupportRecursion::SupportRecursion(const AxisResponse& horizontal, const AxisResponse& vertical, const Vehicle& vehicle)
    : horizontal_(horizontal, vehicle.initial_error.position, vehicle.initial_error.velocity),
      vertical_(vertical, vehicle.initial_error.position, vehicle.initial_error.velocity) {}

void SupportRecursion::step(const DisturbanceBound& w_bar) noexcept {
  horizontal_.step(horizontal(w_bar));
  vertical_.step({w_bar.w[kZ]});
}

PerDirection SupportRecursion::half_widths() const noexcept {
  return together(horizontal_.half_widths(), vertical_.half_widths());
}

PerDirection SupportRecursion::half_widths_until_next(const DisturbanceBound& next) const noexcept {
  return together(horizontal_.half_widths_until_next(horizontal(next)), vertical_.half_widths_until_next({next.w[kZ]}));
}

}  // namespace backwash::reach

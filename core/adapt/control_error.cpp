// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/control_error.hpp"

#include <algorithm>
#include <cmath>

#include "core/loop/position_loop.hpp"
#include "core/types/time.hpp"

namespace backwash::adapt {
namespace {

using reach::axis_loop, reach::ColouredStep, reach::CentrePredictor, reach::ErrorCovariance, reach::Loop;

bool finite(const AirTick& t) noexcept {
  return t.state.p_W.allFinite() && t.state.v_W.allFinite() && std::isfinite(*t.age_s) && *t.age_s >= 0;
}
bool finite(const Setpoint& s) noexcept { return s.p_W.allFinite() && s.v_W.allFinite() && s.a_W.allFinite(); }
bool modelled(const Vec3& sigma) noexcept { return sigma.allFinite() && sigma.minCoeff() > 0; }

}  // namespace

ControlError::ControlError(const Vehicle& vehicle, const Gusts& gusts)
    : vehicle_(vehicle),
      kp_(loop::PositionLoop(vehicle).kp),
      steps_(new Steps{ColouredStep(axis_loop(vehicle, false, Loop::vehicle), gusts.tau_high_s, kControlPeriod),
                       ColouredStep(axis_loop(vehicle, true, Loop::vehicle), gusts.tau_high_s, kControlPeriod)}),
      covariance_(unknown()),
      centre_(vehicle, Loop::vehicle, {}, Vec3::Zero(), {}),
      answer_(centre_),
      steady_(Vec3(gusts.mean_horizontal, gusts.mean_horizontal, gusts.mean_vertical).cwiseQuotient(kp_)) {
  for (const ColouredStep& step : {steps_->horizontal, steps_->vertical}) {
    const auto ticks = [&](double below) {
      return static_cast<int>(std::lround(reach::steady_error(step, below).memory / kControlPeriod));
    };
    spacing_ = std::max(spacing_, ticks(kForgotten));
    settled_ = std::max(settled_, ticks(kSettled));
    const ColouredStep low(step.axis, gusts.tau_low_s, kControlPeriod);
    const double variance = reach::steady_error(step, kForgotten).variance;
    least_ = std::min(least_, reach::steady_error(low, kForgotten).variance / variance);
    reach::AxisLoop late = step.axis;
    for (double& grown : grown_) {
      late.attitude_lag += kLagStep;
      const double with =
          reach::steady_error(ColouredStep(late, gusts.tau_high_s, kControlPeriod), kForgotten).variance;
      grown = std::max(grown, with >= variance ? with / variance : HUGE_VAL);  // of one that is not stable: no number
    }
  }
}

double ControlError::lag_of(double v) const noexcept {
  const auto enough = std::ranges::find_if(grown_, [v](double grown) { return grown >= v; });
  return kLagStep * static_cast<double>(std::min<std::ptrdiff_t>(enough - grown_.begin() + 1, grown_.size()));
}

std::array<ErrorCovariance, 3> ControlError::unknown() const noexcept {
  return {ErrorCovariance(steps_->horizontal), ErrorCovariance(steps_->horizontal), ErrorCovariance(steps_->vertical)};
}

// At rest about what is commanded: what is wrong in it is forgotten when the first sample is taken.
void ControlError::begin(const AirTick& tick) noexcept {
  State now = tick.state;
  now.p_W += *tick.age_s * now.v_W;
  centre_.begin(now, reach::commanded_acceleration(vehicle_, now, tick.command), tick.command);
  answer_.begin({}, Vec3::Zero(), {});
  covariance_ = unknown();
  centres_.fill({now.p_W, now.v_W, Vec3::Zero()});
  errors_ = {};
  ticks_ = since_ = 0;
  mixed_ = false;
  last_ = tick;
}

void ControlError::step(const AirTick& before) noexcept {
  const Vec3 push = kp_.cwiseProduct(centre_.state().v_W);
  const State now = centre_.step(before.command);
  answer_.step({}, push);
  for (int axis = 0; axis < 3; ++axis)
    covariance_[static_cast<std::size_t>(axis)].advance(std::sqrt(before.sigma[axis]));
  std::copy_backward(centres_.begin(), centres_.end() - 1, centres_.end());
  centres_[0] = {now.p_W, now.v_W, centre_.acceleration()};
  ++ticks_;
  ++since_;
}

// The noise of the measured position: what of an error does not lie between the one before and the one after.
void ControlError::measure(const AirTick& tick) noexcept {
  const double ticks = std::ceil(*tick.age_s / kControlPeriod), t = seconds(tick.now_ns) - *tick.age_s;
  const auto back = static_cast<std::size_t>(ticks > 0 ? ticks - 1 : 0);
  const Vec3 centre = centres_[back].before(*tick.age_s - static_cast<double>(back) * kControlPeriod);
  std::copy_backward(errors_.begin(), errors_.end() - 1, errors_.end());
  errors_[0] = Measured{t, tick.state.p_W - centre};
  const auto &after = errors_[0], &between = errors_[1], &before = errors_[2];
  if (!before || !(before->t < between->t && between->t < after->t)) return;
  const double share = (between->t - before->t) / (after->t - before->t);
  const Vec3 off = between->e_W - (1 - share) * before->e_W - share * after->e_W;
  squares_ += off.cwiseAbs2() / (1 + share * share + (1 - share) * (1 - share));
  ++differences_;
}

std::optional<ErrorSample> ControlError::add(const AirTick& given) noexcept {
  AirTick tick = given;
  if (!finite(tick.command)) {
    last_.reset();
    return std::nullopt;
  }
  if (tick.age_s && (!finite(tick) || *tick.age_s > kMostMissed * kControlPeriod)) tick.age_s.reset();
  const bool known = modelled(tick.sigma);
  refused_ += !known;
  const double elapsed = last_ ? seconds(tick.now_ns - last_->now_ns) / kControlPeriod : 0;
  if (!last_ || last_->frame != tick.frame || !(elapsed > 0.5 && elapsed < kMostMissed + 0.5)) {
    last_.reset();
    if (known && tick.age_s) begin(tick);
    return std::nullopt;
  }
  for (int k = 0; k < std::lround(elapsed); ++k) step(*last_);
  mixed_ = mixed_ || !known || tick.air != last_->air;
  if (!known) tick.sigma = last_->sigma;
  last_ = tick;
  if (tick.age_s) measure(tick);
  if (!tick.age_s || ticks_ < settled_ || since_ < spacing_ || differences_ == 0) return std::nullopt;
  ErrorSample sample{mixed_ ? std::nullopt : std::optional(tick.air),
                     kControlPeriod * std::min(since_, ticks_ - settled_ + spacing_),
                     errors_[0]->e_W,
                     {},
                     noise(),
                     {answer_.state().p_W, answer_.state().v_W, answer_.acceleration()}};
  for (int axis = 0; axis < 3; ++axis)
    sample.promised[axis] = std::pow(covariance_[static_cast<std::size_t>(axis)].position_deviation(), 2);
  since_ = 0;
  mixed_ = false;
  return sample;
}

}  // namespace backwash::adapt

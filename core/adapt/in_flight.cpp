// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/in_flight.hpp"

#include <algorithm>

#include "core/types/time.hpp"

namespace backwash::adapt {
namespace {

constexpr double kAnew = 2 * Innovations::kLongestInterval;  // s: a gap to all that follows time

Gusts by_differences(Gusts gusts) {
  gusts.differences = true;
  return gusts;
}

Disturbance disturbance_of(const InFlightConstants& constants) {
  Vehicle vehicle;
  vehicle.controller = constants.controller;
  return Disturbance(vehicle);
}

}  // namespace

InFlight::InFlight(const InFlightConstants& constants)
    : disturbance_(disturbance_of(constants)),
      adaptation_(by_differences(constants.gusts), constants.alpha),
      calmest_(constants.calmest),
      grown_(larger(constants.start, kModelledAir)),
      factors_(grown_) {}

// Since the tick before, by the stamps; nothing where there is none to compare with.
std::optional<Vec3> InFlight::acceleration(const AirTick& tick) noexcept {
  const double dt = last_ && last_->frame == tick.frame ? seconds(tick.stamp_ns - last_->stamp_ns) : 0;
  const bool follows = dt > 0 && dt <= Disturbance::kGap;
  t_s_ += follows ? dt : kAnew;
  const Vec3 a_W = follows ? Vec3((tick.state.v_W - last_->state.v_W) / dt) : Vec3(Vec3::Zero());
  last_ = tick;
  return follows ? std::optional(a_W) : std::nullopt;
}

std::optional<Vec3> InFlight::noise(const Vec3& w_W) noexcept {
  if (last_w_) squares_ += (w_W - *last_w_).cwiseAbs2(), ++steps_;
  last_w_ = w_W;
  return steps_ >= kLeastSteps ? std::optional<Vec3>(squares_ / (2 * steps_)) : std::nullopt;
}

bool InFlight::add(const AirTick& tick) noexcept {
  const auto a_W = acceleration(tick);
  if (!a_W) last_w_.reset();
  const auto w_W = disturbance_.add({t_s_, tick.state, a_W.value_or(Vec3::Zero()), tick.command});
  if (!w_W || !w_W->allFinite()) {
    last_w_.reset();
    return false;
  }
  const auto measured = noise(*w_W);
  if (!measured) return false;
  const AirFactors before = factors_;
  if (adaptation_.add({t_s_, *w_W, tick.sigma, tick.air, *measured})) {
    judge_calm();
    if (!frozen_) grow();
  }
  if (tick.rests && !frozen_) settle();
  return factors_ != before;
}

void InFlight::grow() noexcept {
  grown_ = larger(grown_, adaptation_.factors());
  combine();
}

// What is shown is watched from then on, long before a rest may shrink sets by it: air that was calm once need not be
// so at the next rest. Sets of frozen factors return too: what was shrunk was right in calmer air alone.
void InFlight::judge_calm() noexcept {
  for (std::size_t k = 0; k < kAirClasses; ++k) {
    const auto air = static_cast<AirClass>(k);
    const Bets& bets = adaptation_.of(air);
    if (bets.rose() || bets.above()) {
      calm_[k] = shown_[k] = 1;
      adaptation_.forget_calmer(air);
      continue;
    }
    const double factor = std::max(calmest_, bets.below().value_or(1));
    if (!(factor < shown_[k])) continue;
    shown_[k] = factor;
    adaptation_.watch(air, factor);
  }
  combine();
}

// What no class is known of may be anywhere.
void InFlight::settle() noexcept {
  for (std::size_t k = 0; k < kAirClasses; ++k)
    if (static_cast<AirClass>(k) != AirClass::none && !(grown_[k] > 1)) calm_[k] = shown_[k];
  combine();
}

void InFlight::combine() noexcept {
  for (std::size_t k = 0; k < kAirClasses; ++k) factors_[k] = grown_[k] > 1 ? grown_[k] : calm_[k];
}

void InFlight::forget() noexcept {
  adaptation_.reset();
  factors_ = grown_ = calm_ = shown_ = kModelledAir;
  last_.reset(), last_w_.reset();
  squares_.setZero(), steps_ = 0;
}

bool InFlight::end() noexcept {
  if (!last_) return false;
  last_.reset(), last_w_.reset();
  const AirFactors before = factors_;
  calm_ = shown_ = kModelledAir;
  for (std::size_t k = 0; k < kAirClasses; ++k) adaptation_.forget_calmer(static_cast<AirClass>(k));
  combine();
  return factors_ != before;
}

bool InFlight::carry_out(AirOrder order) noexcept {
  const AirFactors before = factors_;
  if (order == AirOrder::reset) forget();
  if (order == AirOrder::freeze) frozen_ = true;
  if (order == AirOrder::thaw) frozen_ = false, grow();
  return factors_ != before;
}

}  // namespace backwash::adapt

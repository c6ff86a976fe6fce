// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/in_flight.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace backwash::adapt {
namespace {

Vehicle vehicle_of(const InFlightConstants& constants) {
  Vehicle vehicle;
  vehicle.controller = constants.controller;
  return vehicle;
}

constexpr double kMostOfIt = 0.5;
constexpr double kSurelyShown = 28;  // χ² of nine: 1e-3 where there is nothing

}  // namespace

InFlight::InFlight(const InFlightConstants& constants)
    : error_(vehicle_of(constants), constants.gusts),
      alpha_(constants.alpha),
      calmest_(constants.calmest),
      constant_(error_.kp(), false),
      motion_(error_.kp(), true),
      kept_(larger(constants.start, kModelledAir)) {
  forget();
}

// Given the error before, the square of the next is the promised one and what is left of that error at most, and of a
// steady push; what is left of the errors is foretold by no constant.
bool InFlight::bet(const ErrorSample& sample) noexcept {
  const std::array<ErrorSample, 3> kinds{sample, constant_.add(sample), motion_.add(sample)};
  constexpr double kLeft = ControlError::kForgotten * ControlError::kForgotten;
  bool changed = false;
  for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
    const ErrorSample& s = kinds[kind];
    ErrorSquare square{s.seconds, s.e_W.cwiseAbs2(), s.promised, s.noise, kLeft * before_[kind], error_.least()};
    before_[kind] = square.square;
    if (kind == 0) square.granted += error_.steady().cwiseAbs2();
    if (!sample.air) continue;
    const auto k = static_cast<std::size_t>(*sample.air);
    sums_[k][kind] += excess(square, 1);
    if (kind == 0) {
      changed = errors_[k].add(square);
      ++samples_[k];
    }
    if (kind == 2) changed = rest_[k].add(square) || changed;
  }
  return changed;
}

bool InFlight::add(const AirTick& tick) noexcept {
  flown_ = true;
  const AirFactors before = factors_;
  const auto sample = error_.add(tick);
  if (sample && bet(*sample)) {
    judge_calm();
    if (!frozen_) grow();
  }
  if (tick.rests && !frozen_) settle();
  return factors_ != before;
}

Cause InFlight::cause(AirClass air) const noexcept {
  const auto k = static_cast<std::size_t>(air);
  if (!above(air)) return Cause::none;
  const auto& [as_is, less_constant, left] = sums_[k];
  const auto most = [&](double of, double without) {  // of what errors are beyond the promise
    return of > samples_[k] && of - without >= kMostOfIt * (of - samples_[k]);
  };
  if (of(air).above() && most(as_is, less_constant)) return Cause::constant;
  if (most(less_constant, left)) return Cause::motion;
  const double rest = std::max(1.0, left / samples_[k]);
  const bool loop_is_known =
      motion_.shown(rest) < kSurelyShown && motion_.would_show(error_.lag_of(rest), rest) > 2 * kSurelyShown;
  return rest_[k].above() && loop_is_known ? Cause::air : Cause::unknown;
}

void InFlight::grow() noexcept {
  for (std::size_t k = 0; k < kAirClasses; ++k)
    grown_[k] = std::max(grown_[k], above(static_cast<AirClass>(k)).value_or(1));
  combine();
}

// What is shown is watched from then on, long before a rest may shrink sets by it: air that was calm once need not be
// so at the next rest. Sets of frozen factors return too: what was shrunk was right in calmer air alone.
void InFlight::judge_calm() noexcept {
  for (std::size_t k = 0; k < kAirClasses; ++k) {
    Bets& bets = errors_[k];
    if (bets.rose() || above(static_cast<AirClass>(k))) {
      calm_[k] = shown_[k] = 1;
      bets.forget_calmer();
      continue;
    }
    const double factor = std::max(calmest_, bets.below().value_or(1));
    if (!(factor < shown_[k])) continue;
    shown_[k] = factor;
    bets.watch(factor);
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

// All but what is kept.
void InFlight::forget() noexcept {
  error_.forget();
  errors_.fill(Bets(alpha_));
  rest_.fill(Bets(alpha_));
  constant_ = Remainder(error_.kp(), false);
  motion_ = Remainder(error_.kp(), true);
  before_.fill(Vec3::Zero());
  sums_ = {};
  samples_ = {};
  grown_ = kept_;
  calm_ = shown_ = kModelledAir;
  combine();
}

bool InFlight::end() noexcept {
  if (!std::exchange(flown_, false)) return false;
  const AirFactors before = factors_, kept = kept_;
  for (std::size_t k = 0; k < kAirClasses && !frozen_; ++k)
    if (cause(static_cast<AirClass>(k)) == Cause::air) kept_[k] = std::max(kept_[k], *rest_[k].above());
  const AirFactors grown = frozen_ ? grown_ : kept_;
  forget();
  grown_ = grown;
  combine();
  return factors_ != before || kept_ != kept;
}

bool InFlight::carry_out(AirOrder order) noexcept {
  const AirFactors before = factors_;
  if (order == AirOrder::reset) {
    kept_ = kModelledAir;
    forget();
  }
  if (order == AirOrder::freeze) frozen_ = true;
  if (order == AirOrder::thaw) {
    frozen_ = false;
    grow();
  }
  return factors_ != before;
}

}  // namespace backwash::adapt

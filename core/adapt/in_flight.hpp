// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/adapt/bets.hpp"
#include "core/adapt/cause.hpp"
#include "core/adapt/remainder.hpp"

namespace backwash::adapt {

/// What the updates of a flight depend on beside its ticks.
struct InFlightConstants {
  decltype(Vehicle::controller) controller{};
  Gusts gusts;
  double alpha = kAlpha;            ///< in (0, 1)
  AirFactors start = kModelledAir;  ///< what earlier flights have learnt, each ≥ 1
  double calmest = 1;               ///< factors fall so far at most, in (0, 1]; 1: none falls below 1
};

/// What an operator asks of what a flight learns.
enum class AirOrder : std::uint32_t {
  reset,   ///< as modelled, as if nothing had been flown: the one thing that lets a kept factor fall
  freeze,  ///< the factors stay as they are; evidence goes on being counted
  thaw     ///< they follow the evidence again, at once that of meanwhile
};
inline constexpr std::uint32_t kAirOrders = 3;

/// What a flight learns of its errors, class of air by class (docs/model.md section 7). Sets grow by the factor that
/// the errors show, whatever the cause; only of air it outlives the flight. Factors above 1 never fall in flight, but
/// by an order. A named class that is shown to be calmer than modelled gets a factor below 1 in a tick at rest, and 1
/// again as soon as it is shown to be rougher than that. Of two with equal ticks and orders every number is equal, bit
/// for bit.
class InFlight {
 public:
  /// Made before the flight, in some 10 ms. Errors: those of ControlError.
  explicit InFlight(const InFlightConstants& constants);

  /// One tick; whether a factor changed. Real-time: wait-free, no allocation.
  bool add(const AirTick& tick) noexcept;
  /// Does what is asked; whether a factor changed. Whoever asks sees to it that nothing flies on sets that shrink.
  /// Real-time: wait-free, no allocation.
  bool carry_out(AirOrder order) noexcept;
  bool frozen() const noexcept { return frozen_; }
  /// The flight has ended: the next one begins with what is kept, and learns anew; whether a factor or what is
  /// kept changed. Nothing happens without a tick since the last one ended. Real-time: wait-free, no allocation.
  bool end() noexcept;

  /// ≥ calmest; ≥ what it began with until a reset.
  const AirFactors& factors() const noexcept { return factors_; }
  /// What outlives flights, each ≥ 1: of rougher air, from the end of the flight that showed it.
  const AirFactors& kept() const noexcept { return kept_; }
  Cause cause(AirClass air) const noexcept;
  /// Bets on the errors as they are, and on what neither a constant nor the motion explains.
  const Bets& of(AirClass air) const noexcept { return errors_[static_cast<std::size_t>(air)]; }
  const Bets& rest_of(AirClass air) const noexcept { return rest_[static_cast<std::size_t>(air)]; }
  /// Of both the larger: the factor that was refuted, and the evidence. Real-time: wait-free, no allocation.
  std::optional<double> above(AirClass air) const noexcept {
    return std::max(of(air).above(), rest_of(air).above());  // nothing is less than any
  }
  double ln_evidence(AirClass air) const noexcept {
    return std::max(of(air).ln_evidence(), rest_of(air).ln_evidence());
  }
  double ln_changed(AirClass air) const noexcept { return std::max(of(air).ln_changed(), rest_of(air).ln_changed()); }
  std::uint64_t refused() const noexcept { return error_.refused(); }  ///< ticks
  Vec3 noise() const noexcept { return error_.noise(); }               ///< variance of the measured position, m²
  double spacing_s() const noexcept { return error_.spacing_s(); }     ///< from one sample to the next

 private:
  using AllBets = std::array<Bets, kAirClasses>;
  bool bet(const ErrorSample& sample) noexcept;
  void grow() noexcept;
  void judge_calm() noexcept;
  void settle() noexcept;
  void combine() noexcept;
  void forget() noexcept;

  ControlError error_;
  double alpha_, calmest_;
  AllBets errors_, rest_;  // on errors as they are; on what is left of them
  Remainder constant_, motion_;
  /// Of the errors, of them less a constant, less the motion's part too: squares of the sample before, and by class
  /// the sums over their expectation as modelled.
  std::array<Vec3, 3> before_;
  std::array<std::array<double, 3>, kAirClasses> sums_;
  std::array<double, kAirClasses> samples_;
  AirFactors kept_, grown_, calm_ = kModelledAir;  // grown_ ≥ kept_ ≥ 1, rising in flight; calm_ ≤ 1
  AirFactors shown_ = kModelledAir;                // ≤ calm_, and watched: what calm_ becomes at rest
  AirFactors factors_;
  bool frozen_ = false, flown_ = false;
};

}  // namespace backwash::adapt

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/adapt/bets.hpp"

namespace backwash::adapt {

/// What a flight learns of its air, class by class (docs/model.md section 7). Starts with nothing; of two with equal
/// samples every number is equal, bit for bit. Made before the flight: the constructor takes 30 ms.
class Adaptation {
 public:
  explicit Adaptation(const Gusts& gusts, double alpha = kAlpha)
      : innovations_(gusts), pairs_(gusts, MeansOf::pairs), none_(alpha) {
    reset();
  }

  /// Nothing is known any more. Real-time: wait-free, no allocation.
  void reset() noexcept { bets_.fill(none_); }

  /// One tick; whether a class's factor or limit may have changed. Real-time: wait-free, no allocation.
  bool add(const AirSample& sample) noexcept {
    bool changed = false;
    if (const auto pair = pairs_.add(sample)) changed = bets_[static_cast<std::size_t>(pair->air)].add_pair(*pair);
    const auto innovation = innovations_.add(sample);
    if (!innovation) return changed;
    auto& bets = bets_[static_cast<std::size_t>(innovation->air)];
    const auto above = bets.above(), below = bets.below();
    const bool rose = bets.rose();
    bets.add(*innovation);
    return changed || bets.above() != above || bets.below() != below || bets.rose() != rose;
  }
  /// Factor on Σ in a class, max(1, v_lo): never below 1, never falls. Sets grow by its root.
  double factor(AirClass air) const noexcept { return std::max(1.0, of(air).above().value_or(1)); }
  AirFactors factors() const noexcept {
    AirFactors all;
    for (std::size_t k = 0; k < kAirClasses; ++k) all[k] = factor(static_cast<AirClass>(k));
    return all;
  }
  /// Sets are shrunk to this factor, and whether that is too little is watched. Real-time: wait-free, no allocation.
  void watch(AirClass air, double factor) noexcept { bets_[static_cast<std::size_t>(air)].watch(factor); }
  /// That a class is calmer is shown anew. Real-time: wait-free, no allocation.
  void forget_calmer(AirClass air) noexcept { bets_[static_cast<std::size_t>(air)].forget_calmer(); }
  const Bets& of(AirClass air) const noexcept { return bets_[static_cast<std::size_t>(air)]; }
  std::uint64_t refused() const noexcept { return innovations_.refused(); }  ///< samples

 private:
  Innovations innovations_, pairs_;
  Bets none_;  // of a class that was not flown in
  std::array<Bets, kAirClasses> bets_;
};

}  // namespace backwash::adapt

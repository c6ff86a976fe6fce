// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <functional>

#include "tests/gusts/flown_loop.hpp"

namespace backwash::adapt::test {

inline InFlightConstants constants() {
  InFlightConstants c;
  c.controller = gusts::quad_5in();
  return c;
}

/// A flight of the 5-inch vehicle near a wall, what it learns, and ticks that a test spoils before they are learnt of.
struct GustyFlight {
  gusts::FlownLoop loop;
  InFlight learnt;
  AirClass place = AirClass::wall;
  std::function<void(AirTick&)> spoil = [](AirTick&) {};
  double t = 0;
  int rises = 0;

  explicit GustyFlight(std::uint64_t seed, const InFlightConstants& c = constants(), gusts::Trial trial = {})
      : loop(c.controller, (trial.seed = seed, trial)), learnt(c) {}
  double& factor() { return loop.factor; }
  GustyFlight& fly(double seconds) {
    for (const double end = t + seconds - 1e-9; t < end; t = loop.t()) {
      AirTick tick = loop.tick();
      tick.air = place;
      spoil(tick);
      const AirFactors before = learnt.factors();
      const bool changed = learnt.add(tick);
      rises += changed;
      EXPECT_EQ(changed, learnt.factors() != before);
      for (std::size_t k = 0; k < kAirClasses && !tick.rests; ++k)
        EXPECT_GE(learnt.factors()[k], before[k]) << "a factor fell in motion";
    }
    return *this;
  }
  double wall() const { return learnt.factors()[static_cast<std::size_t>(AirClass::wall)]; }
  const Bets& bets() const { return learnt.of(AirClass::wall); }
};

}  // namespace backwash::adapt::test

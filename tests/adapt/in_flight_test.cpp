// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/in_flight.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/adapt/gusty_flight.hpp"

namespace backwash::adapt {
namespace {

using namespace test;

TEST(InFlight, AirAsModelledIsCalledRougherInAtMostOneFlightOfAHundred) {
  int told = 0, flights = 0;
  for (const gusts::Form form : gusts::kForms)
    for (const auto& [rate, noise] : {std::pair{50.0, 0.0}, {50.0, 0.03}, {10.0, 0.0}, {10.0, 0.03}, {30.0, 0.01}})
      for (std::uint64_t seed = 1; seed <= 20; ++seed, ++flights) {
        GustyFlight flight(1000 * seed + static_cast<std::uint64_t>(rate), constants(), form);
        flight.rate_hz = rate, flight.velocity_noise = noise;
        told += flight.fly(60).rises > 0;
      }
  EXPECT_EQ(flights, 300);
  EXPECT_LE(told, 7) << "of 300: 8 or more have a probability of 1.2 % at α = 1 %";
}

// Means are printed. Where a group is one sample, gusts and noise cannot be told apart by their steps: at 10 Hz.
TEST(InFlight, RougherAirIsFoundAsSoonAsRateAndNoiseOfTheVelocityAllow) {
  const struct {
    double rate_hz, noise_mps, factor, within_s;
  } rows[] = {{50, 0, 2, 20},    {50, 0, 4, 10},     {50, 0.005, 2, 60}, {50, 0.005, 4, 15}, {50, 0.01, 4, 40},
              {50, 0.01, 8, 15}, {30, 0.005, 4, 20}, {25, 0, 4, 30},     {25, 0.01, 4, 40},  {10, 0, 16, 60}};
  for (const auto& row : rows) {
    int found = 0;
    double mean_s = 0;
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      GustyFlight flight(seed);
      flight.rate_hz = row.rate_hz, flight.factor = row.factor, flight.velocity_noise = row.noise_mps;
      while (flight.t < 60 && flight.wall() == 1) flight.fly(0.2);
      found += flight.wall() > 1 && flight.t <= row.within_s, mean_s += flight.t / 10;
      EXPECT_EQ(flight.learnt.factors()[static_cast<std::size_t>(AirClass::free_air)], 1);
    }
    std::printf("%g Hz, noise %g m/s, x%g: found in %.1f s on the mean\n", row.rate_hz, row.noise_mps, row.factor,
                mean_s);
    EXPECT_GE(found, 9) << row.rate_hz << " Hz, noise " << row.noise_mps << " m/s, x" << row.factor;
  }
}

// A tick that waits for the right size never tells more than what blows.
TEST(InFlight, WhatIsToldIsBelowWhatBlows) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    GustyFlight flight(seed);
    flight.factor = 4;
    EXPECT_LT(flight.fly(60).wall(), 4.0) << seed;
    EXPECT_GE(flight.wall(), 1.68) << seed;
  }
}

TEST(InFlight, AClassThatIsNotKnownLearnsForAll) {
  GustyFlight flight(3);
  flight.place = AirClass::none, flight.factor = 4;
  flight.fly(20);
  EXPECT_EQ(flight.wall(), 1);
  EXPECT_GT(flight.learnt.factors()[static_cast<std::size_t>(AirClass::none)], 1);
  for (std::size_t k = 0; k < kAirClasses; ++k)
    EXPECT_GT(factor_of(flight.learnt.factors(), static_cast<AirClass>(k)), 1);
}

TEST(InFlight, BeginsWithWhatWasLearntAndNeverFallsBelowIt) {
  InFlightConstants c = constants();
  c.start = {1, 0.5, 1.5, 1, 1};
  GustyFlight flight(4, c);
  EXPECT_EQ(flight.learnt.factors(), (AirFactors{1, 1, 1.5, 1, 1})) << "below 1 nothing begins";
  flight.fly(60);
  EXPECT_EQ(flight.wall(), 1.5);
  flight.factor = 4;
  EXPECT_GE(flight.fly(2).wall(), 1.5) << "also while less than that is shown";
  flight.fly(60);
  EXPECT_GT(flight.wall(), 1.5);
}

TEST(InFlight, WhatIsNoNumberAndWhatHasNoModelIsLeftOut) {
  const auto spoilt = [](const std::function<void(AirTick&)>& spoil) {
    GustyFlight flight(5);
    int n = 0;
    flight.spoil = [&](AirTick& tick) { ++n % 50 == 0 ? spoil(tick) : void(); };
    flight.factor = 4;
    return flight.fly(40).wall();
  };
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    EXPECT_GT(spoilt([&](AirTick& tick) { tick.sigma.y() = bad; }), 1);
    EXPECT_GT(spoilt([&](AirTick& tick) { tick.state.v_W.z() = bad; }), 1);
    EXPECT_GT(spoilt([&](AirTick& tick) { tick.command.a_W.x() = bad; }), 1);
  }
  GustyFlight nowhere(5);
  nowhere.factor = 4, nowhere.sigma = Vec3::Zero();
  EXPECT_EQ(nowhere.fly(20).rises, 0);
  EXPECT_GT(nowhere.learnt.refused(), 500u);
}

// One that only starts anew must not lose what it knows, and no step across it is an acceleration.
TEST(InFlight, AClockThatIsSetAFrameThatMovesAndAGapAreNoRoughAir) {
  for (int fault = 0; fault < 3; ++fault) {
    GustyFlight flight(6 + static_cast<std::uint64_t>(fault));
    int n = 0;
    std::uint64_t frame = 0;
    std::int64_t shift = 0;
    flight.spoil = [&](AirTick& tick) {
      if (++n % 100 == 0)
        fault == 0 ? void(shift -= 7'000'000'000) : fault == 1 ? void(++frame) : void(shift += 400'000'000);
      tick.stamp_ns += shift, tick.frame = frame;
      // The frame turns with it.
      if (frame % 2 == 1)
        tick.state.v_W.x() *= -1, tick.state.p_W.x() *= -1, tick.command.p_W.x() *= -1, tick.command.v_W.x() *= -1,
            tick.command.a_W.x() *= -1;
    };
    EXPECT_EQ(flight.fly(40).rises, 0) << fault;
    flight.factor = 4;
    EXPECT_GT(flight.fly(40).rises, 0) << fault;
    EXPECT_LT(flight.learnt.of(AirClass::wall).seconds(), 70) << "each time it begins anew, fault " << fault;
  }
}

TEST(InFlight, OfTwoWithEqualTicksEveryNumberIsEqual) {
  GustyFlight a(7), b(7);
  a.factor = b.factor = 2;
  a.fly(30), b.fly(30);
  EXPECT_EQ(a.learnt.factors(), b.learnt.factors());
  EXPECT_EQ(a.learnt.of(AirClass::wall).ln_evidence(), b.learnt.of(AirClass::wall).ln_evidence());
}

TEST(InFlight, ALargerAlphaIsReachedByLessEvidence) {
  InFlightConstants eager = constants();
  eager.alpha = 0.1;
  int later = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    GustyFlight a(seed), b(seed, eager);
    a.factor = b.factor = 2;
    while (a.t < 60 && a.wall() == 1) a.fly(0.1);
    while (b.t < 60 && b.wall() == 1) b.fly(0.1);
    EXPECT_LE(b.t, a.t);
    later += b.t < a.t;
  }
  EXPECT_GE(later, 5);
}

TEST(InFlight, FrozenFactorsStayAndThawedOnesAreThoseOfAFlightThatWasNeverFrozen) {
  GustyFlight free(8), frozen(8);
  free.factor = frozen.factor = 4;
  EXPECT_FALSE(frozen.learnt.carry_out(AirOrder::freeze));
  free.fly(30), frozen.fly(30);
  ASSERT_GT(free.wall(), 1);
  EXPECT_EQ(frozen.learnt.factors(), kModelledAir);
  EXPECT_EQ(frozen.learnt.of(AirClass::wall).ln_evidence(), free.learnt.of(AirClass::wall).ln_evidence());
  EXPECT_TRUE(frozen.learnt.carry_out(AirOrder::thaw));
  EXPECT_EQ(frozen.learnt.factors(), free.learnt.factors());
  EXPECT_FALSE(frozen.learnt.carry_out(AirOrder::thaw)) << "nothing is new";
}

// What is flown after it is learnt as by a flight that begins there; stored factors count no more either.
TEST(InFlight, AfterAResetNothingOfBeforeCounts) {
  InFlightConstants c = constants();
  c.start = {1, 1, 1.5, 1, 1};
  GustyFlight flight(9, c);
  flight.factor = 4;
  flight.fly(20.01);
  ASSERT_GT(flight.wall(), 1.5);
  EXPECT_TRUE(flight.learnt.carry_out(AirOrder::reset));
  EXPECT_EQ(flight.learnt.factors(), kModelledAir);
  EXPECT_EQ(flight.learnt.of(AirClass::wall).seconds(), 0);
  EXPECT_EQ(flight.learnt.of(AirClass::wall).ln_evidence(), 0);
  InFlight anew(constants());
  flight.spoil = [&](AirTick& tick) { anew.add(tick); };
  flight.fly(20);
  EXPECT_GT(flight.wall(), 1) << "it learns again";
  EXPECT_EQ(flight.learnt.factors(), anew.factors());
  const Bets &now = flight.learnt.of(AirClass::wall), &other = anew.of(AirClass::wall);
  EXPECT_NEAR(now.ln_evidence(), other.ln_evidence(), 0.1 * other.ln_evidence()) << "groups may begin a sample later";
  EXPECT_NEAR(now.seconds(), other.seconds(), 0.1);
}

}  // namespace
}  // namespace backwash::adapt

// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/in_flight.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/adapt/gusty_flight.hpp"

namespace backwash::adapt {
namespace {

using namespace test;

// Velocities are looked at where a flight begins alone.
TEST(InFlight, NeitherNoiseNorRateMakeItRougherNorHideIt) {
  int told = 0, found = 0;
  for (const auto& [rate, position, velocity] :
       {std::tuple{50.0, 0.0, 0.05}, {50.0, 0.005, 0.05}, {30.0, 0.002, 0.02}, {16.7, 0.005, 0.05}})
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      gusts::Trial trial;
      trial.rate_hz = rate;
      trial.position_noise = position;
      trial.velocity_noise = velocity;
      GustyFlight calm(seed, constants(), trial), rough(seed, constants(), trial);
      told += calm.fly(60).bets().above().has_value();
      rough.factor() = 6;
      found += rough.fly(60).wall() > 1;
    }
  EXPECT_LE(told, 2) << "of 40";
  EXPECT_GE(found, 38) << "of 40";
}

// A tick that waits for the right size never tells more than what blows.
TEST(InFlight, WhatIsToldIsBelowWhatBlows) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    GustyFlight flight(seed);
    flight.factor() = 4;
    EXPECT_LT(flight.fly(120).wall(), 4.0) << seed;
    EXPECT_GE(flight.wall(), 1.68) << seed;
  }
}

TEST(InFlight, AClassThatIsNotKnownLearnsForAll) {
  GustyFlight flight(3);
  flight.place = AirClass::none;
  flight.factor() = 4;
  flight.fly(40);
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
  flight.factor() = 6;
  EXPECT_GE(flight.fly(4).wall(), 1.5) << "also while less than that is shown";
  flight.fly(60);
  EXPECT_GT(flight.wall(), 1.5);
}

TEST(InFlight, WhatIsNoNumberAndWhatHasNoModelIsLeftOut) {
  const auto spoilt = [](const std::function<void(AirTick&)>& spoil) {
    GustyFlight flight(5), calm(5);
    int n = 0;
    flight.spoil = calm.spoil = [&](AirTick& tick) { ++n % 300 == 0 ? spoil(tick) : void(); };
    flight.factor() = 6;
    EXPECT_FALSE(calm.fly(60).bets().above()) << "it is no rough air";
    return flight.fly(60).wall();
  };
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    EXPECT_GT(spoilt([&](AirTick& tick) { tick.sigma.y() = bad; }), 1);
    EXPECT_GT(spoilt([&](AirTick& tick) { tick.state.p_W.z() = bad; }), 1);
    EXPECT_GT(spoilt([&](AirTick& tick) { tick.state.v_W.z() = bad; }), 1);
    EXPECT_GT(spoilt([&](AirTick& tick) { tick.age_s = bad; }), 1);
    EXPECT_GT(spoilt([&](AirTick& tick) { tick.command.a_W.x() = bad; }), 1);
  }
  GustyFlight nowhere(5);
  nowhere.factor() = 6;
  nowhere.spoil = [](AirTick& tick) { tick.sigma.setZero(); };
  EXPECT_EQ(nowhere.fly(20).rises, 0);
  EXPECT_GT(nowhere.learnt.refused(), 500u);
}

TEST(InFlight, AClockThatIsSetAFrameThatMovesAndAGapAreNoRoughAir) {
  for (int fault = 0; fault < 3; ++fault) {
    GustyFlight flight(6 + static_cast<std::uint64_t>(fault));
    int n = 0;
    std::uint64_t frame = 0;
    std::int64_t shift = 0;
    flight.spoil = [&](AirTick& tick) {
      if (++n % 400 == 0)
        fault == 0 ? void(shift -= 7'000'000'000) : fault == 1 ? void(++frame) : void(shift += 400'000'000);
      tick.now_ns += shift;
      tick.frame = frame;
      // The frame turns with it.
      if (frame % 2 == 1) {
        tick.state.v_W.x() *= -1;
        tick.state.p_W.x() *= -1;
        tick.command.p_W.x() *= -1;
        tick.command.v_W.x() *= -1;
        tick.command.a_W.x() *= -1;
      }
    };
    EXPECT_EQ(flight.fly(60).rises, 0) << fault;
    flight.factor() = 6;
    EXPECT_GT(flight.fly(60).rises, 0) << fault;
    EXPECT_LT(flight.bets().seconds(), 105) << "each time it begins anew, fault " << fault;
  }
}

TEST(InFlight, OfTwoWithEqualTicksEveryNumberIsEqual) {
  GustyFlight a(7), b(7);
  a.factor() = b.factor() = 4;
  a.fly(30);
  b.fly(30);
  EXPECT_EQ(a.learnt.factors(), b.learnt.factors());
  EXPECT_EQ(a.bets().ln_evidence(), b.bets().ln_evidence());
}

TEST(InFlight, ALargerAlphaIsReachedByLessEvidence) {
  InFlightConstants eager = constants();
  eager.alpha = 0.1;
  int later = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    GustyFlight a(seed), b(seed, eager);
    a.factor() = b.factor() = 3;
    while (a.t < 60 && a.wall() == 1) a.fly(0.1);
    while (b.t < 60 && b.wall() == 1) b.fly(0.1);
    EXPECT_LE(b.t, a.t);
    later += b.t < a.t;
  }
  EXPECT_GE(later, 5);
}

TEST(InFlight, FrozenFactorsStayAndThawedOnesAreThoseOfAFlightThatWasNeverFrozen) {
  GustyFlight free(8), frozen(8);
  free.factor() = frozen.factor() = 6;
  EXPECT_FALSE(frozen.learnt.carry_out(AirOrder::freeze));
  free.fly(30);
  frozen.fly(30);
  ASSERT_GT(free.wall(), 1);
  EXPECT_EQ(frozen.learnt.factors(), kModelledAir);
  EXPECT_EQ(frozen.bets().ln_evidence(), free.bets().ln_evidence());
  EXPECT_TRUE(frozen.learnt.carry_out(AirOrder::thaw));
  EXPECT_EQ(frozen.learnt.factors(), free.learnt.factors());
  EXPECT_FALSE(frozen.learnt.carry_out(AirOrder::thaw)) << "nothing is new";
}

// What is flown after it is learnt as by a flight that begins there; stored factors count no more either.
TEST(InFlight, AfterAResetNothingOfBeforeCounts) {
  InFlightConstants c = constants();
  c.start = {1, 1, 1.5, 1, 1};
  GustyFlight flight(9, c);
  flight.factor() = 6;
  flight.fly(40.01);
  ASSERT_GT(flight.wall(), 1.5);
  EXPECT_TRUE(flight.learnt.carry_out(AirOrder::reset));
  EXPECT_EQ(flight.learnt.factors(), kModelledAir);
  EXPECT_EQ(flight.learnt.kept(), kModelledAir);
  EXPECT_EQ(flight.bets().seconds(), 0);
  EXPECT_EQ(flight.bets().ln_evidence(), 0);
  InFlight anew(constants());
  flight.spoil = [&](AirTick& tick) { anew.add(tick); };
  flight.fly(40);
  EXPECT_GT(flight.wall(), 1) << "it learns again";
  EXPECT_EQ(flight.learnt.factors(), anew.factors());
  EXPECT_EQ(flight.bets().ln_evidence(), anew.of(AirClass::wall).ln_evidence());
}

TEST(InFlight, OfAFlightThatHasEndedTheRoughAirIsKeptAndALoadIsNot) {
  GustyFlight rough(10);
  rough.factor() = 6;
  const double told = rough.fly(120).wall();
  ASSERT_EQ(rough.learnt.cause(AirClass::wall), Cause::air);
  EXPECT_EQ(rough.learnt.kept(), kModelledAir) << "not before the flight has ended";
  rough.learnt.end();
  EXPECT_GT(rough.wall(), 1.5);
  EXPECT_LE(rough.wall(), told);
  EXPECT_EQ(rough.learnt.factors(), rough.learnt.kept());
  EXPECT_FALSE(rough.learnt.end());
  EXPECT_EQ(rough.learnt.cause(AirClass::wall), Cause::none) << "of the next flight nothing is known";
  gusts::Trial load;
  load.load = 0.05;
  GustyFlight heavy(10, constants(), load);
  ASSERT_GT(heavy.fly(60).wall(), 4);
  EXPECT_TRUE(heavy.learnt.end());
  EXPECT_EQ(heavy.learnt.factors(), kModelledAir);
}

// In air that is no rougher than what the model says of the largest steady push errors are as promised.
TEST(InFlight, ASteadyPushThatTheModelAllowsForIsGranted) {
  InFlightConstants allows = constants();
  allows.gusts.mean_horizontal = 0.1;
  gusts::Trial trial;
  trial.push = 0.1;
  EXPECT_GT(GustyFlight(11, constants(), trial).fly(60).wall(), 1);
  EXPECT_EQ(GustyFlight(11, allows, trial).fly(60).rises, 0);
}

}  // namespace
}  // namespace backwash::adapt

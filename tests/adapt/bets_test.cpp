// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/bets.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/adapt/in_flight.hpp"

namespace backwash::adapt {
namespace {

/// An error whose square over its expectation is x on every axis.
ErrorSquare of_square(double x) { return {0.06, Vec3::Constant(x), Vec3::Ones(), Vec3::Zero(), Vec3::Zero(), 1}; }

TEST(Bets, NoSquareMakesTheEvidenceLessThanNothing) {
  for (const double x : {0.0, 1.0, 15.9, 16.0, 1e9, 1e300}) {
    Bets bets;
    for (int k = 0; k < 5000; ++k) bets.add(of_square(x));
    EXPECT_FALSE(std::isnan(bets.ln_evidence())) << x;
    EXPECT_FALSE(std::isnan(bets.ln_changed())) << x;
    EXPECT_GE(bets.ln_evidence(), 0) << x;
    EXPECT_EQ(bets.above().has_value(), x > 1) << x;
    EXPECT_EQ(bets.below().has_value(), x < 0.8) << x;
  }
}

/// Share of flights of 2000 squares that are ever called rougher; squares are `high` with probability 1/high, else 0.
double alarms(double high, int flights) {
  std::mt19937_64 rng(5);
  int count = 0;
  for (int f = 0; f < flights; ++f) {
    Bets bets;
    for (int k = 0; k < 2000 && !bets.above(); ++k)
      bets.add(of_square(std::generate_canonical<double, 53>(rng) < 1 / high ? high : 0));
    count += bets.above().has_value();
  }
  return static_cast<double>(count) / flights;
}

TEST(Bets, SquaresOfMeanOneRaiseNoMoreAlarmsThanIsSaidWhateverTheirTails) {
  // Ville's bound of one class and the detector's of 120 s.
  for (const double high : {1.5, 2.0, 5.0, 16.0, 100.0})
    EXPECT_LE(alarms(high, 1000), kAlpha / kAirClasses + 120 / kRunLength + 0.003) << high;
}

TEST(Bets, TheEvidenceOfOneLargeSquareIsItsBetNoMore) {
  Bets bets;
  bets.add(of_square(1e6));  // counts 16: mean of 1 + 15 λ
  double expected = 0;
  for (const double stake : Bets::kStakes) expected += (1 + 15 * stake) / Bets::kStakes.size();
  EXPECT_NEAR(std::exp(bets.ln_evidence()), expected, 1e-12);
}

TEST(Bets, AFactorIsRefutedOnlyBelowWhatTheSquaresHold) {
  for (const double v : {1.5, 2.5, 5.0}) {
    std::mt19937_64 rng(7);
    std::normal_distribution<double> normal;
    int wrong = 0, near = 0;
    for (int f = 0; f < 60; ++f) {
      Bets bets;
      for (int k = 0; k < 2000; ++k) {
        ErrorSquare i = of_square(0);
        for (int axis = 0; axis < 3; ++axis) i.square[axis] = v * std::pow(normal(rng), 2);
        bets.add(i);
      }
      wrong += bets.above().value_or(0) > v;
      near += bets.above().value_or(0) > 0.7 * v;
    }
    EXPECT_LE(wrong, 1) << v;
    EXPECT_GE(near, 57) << v;
  }
}

TEST(Bets, CalmerAirIsSaidAfterAMinuteAndNeverTooCalm) {
  std::mt19937_64 rng(9);
  std::normal_distribution<double> normal;
  int early = 0, too_calm = 0, near = 0;
  for (int f = 0; f < 60; ++f) {
    Bets bets;
    for (int k = 0; k < 500; ++k) {
      ErrorSquare i = of_square(0);
      i.seconds = 0.36;
      for (int axis = 0; axis < 3; ++axis) i.square[axis] = 0.4 * std::pow(normal(rng), 2);
      bets.add(i);
      early += bets.seconds() < kLeastCalm && bets.below();
    }
    too_calm += bets.below().value_or(1) < 0.4;
    near += bets.below().value_or(1) < 0.75;
    EXPECT_FALSE(bets.above());
  }
  EXPECT_EQ(early, 0);
  EXPECT_LE(too_calm, 1);
  EXPECT_GE(near, 57);
}

TEST(Bets, NoiseAndPushAreGrantedToTheRougherSideAlone) {
  Bets granted, calm;
  for (int k = 0; k < 2000; ++k) {
    auto i = of_square(1.8);
    i.noise = Vec3::Constant(0.5);
    i.granted = Vec3::Constant(0.5);
    granted.add(i);
    i.square = Vec3::Constant(0.9);
    calm.add(i);
  }
  EXPECT_FALSE(granted.above());
  EXPECT_FALSE(calm.below());
}

TEST(Bets, CalmerAirIsThatOfTheTimeThatSaysLeastOfIt) {
  Bets bets, calm;
  auto i = of_square(0.6);
  i.least = 0.5;
  for (int k = 0; k < 2000; ++k) bets.add(i);
  i.square = Vec3::Constant(0.3);
  for (int k = 0; k < 2000; ++k) calm.add(i);
  EXPECT_FALSE(bets.below());
  EXPECT_TRUE(calm.below());
}

// A square tells what the cap leaves of it: of a Gaussian's 0.858, so that 0.8 is asked.
TEST(Bets, ASquareBeyondTheCapCountsAsMuchAsTheCap) {
  Bets calm, wild;
  auto small = of_square(0.3), large = of_square(100);
  for (int k = 0; k < 2000; ++k) {
    calm.add(small);
    wild.add(k % 4 == 0 ? large : small);
  }
  EXPECT_TRUE(calm.below());
  EXPECT_FALSE(wild.below());
}

TEST(Bets, AirThatIsRougherThanWhatSetsWereShrunkToIsFound) {
  Bets bets;
  bets.watch(0.5);
  auto i = of_square(0.5);
  for (int k = 0; k < 1000; ++k) bets.add(i);
  EXPECT_FALSE(bets.rose()) << "as calm as that";
  i.square = Vec3::Constant(1.5);
  double seconds = 0;
  for (; !bets.rose() && seconds < 60; seconds += i.seconds) bets.add(i);
  EXPECT_LT(seconds, 2);
  EXPECT_FALSE(bets.above()) << "the model's variance is not refuted";
  bets.forget_calmer();
  EXPECT_FALSE(bets.rose());
}

TEST(Bets, OfASquareBeyondAllFactorsTheLastIsTold) {
  Bets bets;
  for (int k = 0; k < 500; ++k) bets.add(of_square(1e4));
  EXPECT_EQ(bets.above(), 64);
  EXPECT_EQ(bets.beyond(), 1500);
  EXPECT_NEAR(bets.promised_beyond(), 15, 1e-9);
}

TEST(AirClass, WithoutAClassRougherAirCountsForAllAndNoneIsCalmerByIt) {
  EXPECT_EQ(factor_of({1, 0.5, 1, 1, 1}, AirClass::ground), 0.5);
  EXPECT_EQ(factor_of({1, 0.5, 1, 1, 1}, AirClass::wall), 1);
  EXPECT_EQ(factor_of({1, 0.5, 1, 1, 2}, AirClass::ground), 2);
  EXPECT_EQ(factor_of({1, 3, 1, 1, 2}, AirClass::ground), 3);
  EXPECT_EQ(factor_of({1, 3, 1, 1, 1}, AirClass::none), 1);
}

TEST(AirClass, IsTheTermWithTheLargestTrace) {
  const Variance small{1, 0, 0, 1, 0, 1}, large{1, 0, 0, 1, 0, 2}, nothing{};
  EXPECT_EQ(dominant(large, small, small, small), AirClass::free_air);
  EXPECT_EQ(dominant(small, large, small, small), AirClass::ground);
  EXPECT_EQ(dominant(small, nothing, large, small), AirClass::wall);
  EXPECT_EQ(dominant(small, nothing, small, large), AirClass::corner);
  EXPECT_EQ(dominant(small, small, nothing, nothing), AirClass::free_air);
  EXPECT_EQ(dominant({std::nan(""), 0, 0, 0, 0, 0}, small, nothing, nothing), AirClass::none);
  EXPECT_STREQ(to_string(AirClass::corner), "corner");
}

}  // namespace
}  // namespace backwash::adapt

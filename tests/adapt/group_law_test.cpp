// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/group_law.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/adapt/innovations.hpp"
#include "tests/gusts/gust_air.hpp"

namespace backwash::adapt {
namespace {

TEST(GroupLaw, EveryFormHasTheCorrelationTimeItIsGiven) {
  for (const GustForm form : kGustForms) {
    constexpr double kTau = 0.15, kStep = 2e-4;
    double integral = 0;
    for (int k = 0; k < 20000; ++k) integral += kStep * correlation(form, (k + 0.5) * kStep, kTau);
    EXPECT_NEAR(integral, kTau, 2e-3 * kTau) << static_cast<int>(form);
    EXPECT_DOUBLE_EQ(correlation(form, 0, kTau), 1);
  }
}

/// Mean square of the innovations in air of continuous time over what the table says of it at most.
double over_most(gusts::Form form, double tau_s, double rate_hz, bool told) {
  Gusts calibrated;
  calibrated.tau_low_s = 0.14, calibrated.tau_high_s = 0.16;
  if (told) calibrated.form = static_cast<GustForm>(form);
  Innovations innovations(calibrated);
  gusts::GustAir air(form, tau_s, {}, 11);
  const int steps = static_cast<int>(std::lround(1 / (rate_hz * gusts::GustAir::kStep)));
  double sum = 0, count = 0;
  for (int k = 0; k < 15000; ++k) {
    Vec3 gust = air.step();
    for (int i = 1; i < steps; ++i) gust = air.step();
    if (const auto i = innovations.add({(k + 1) / rate_hz, gust, Vec3::Ones(), AirClass::wall}))
      sum += i->square.mean() / i->most, count += 1;
  }
  return sum / count;
}

TEST(GroupLaw, InnovationsOfEveryFormAreNoLargerThanIsSaid) {
  for (const gusts::Form form : gusts::kForms)
    for (const double rate : {10.0, 50.0, 200.0})
      for (const bool told : {false, true})
        EXPECT_LT(over_most(form, 0.14, rate, told), 1.04) << rate << " Hz, form " << static_cast<int>(form);
}

TEST(GroupLaw, OfAToldFormAtTheLowestTimeTheyAreAsLargeAsIsSaid) {
  for (const gusts::Form form : gusts::kForms)
    for (const double rate : {10.0, 50.0, 200.0})
      EXPECT_GT(over_most(form, 0.14, rate, true), 0.94) << rate << " Hz, form " << static_cast<int>(form);
}

TEST(GroupLaw, WithoutTheFormASampleAtFiftyHertzStillTellsThreeQuarters) {
  for (const gusts::Form form : gusts::kForms) EXPECT_GT(over_most(form, 0.14, 50, false), 0.7);
}

TEST(Innovations, WhatCannotBeUsedIsRefusedAndCounted) {
  Innovations innovations({});
  const double nan = std::nan("");
  for (int k = 0; k < 50; ++k) {
    const double t = 0.02 * k;
    innovations.add({t, Vec3::Ones(), Vec3::Ones(), AirClass::wall});
    EXPECT_FALSE(innovations.add({t + 0.001, Vec3(0, nan, 0), Vec3::Ones(), AirClass::wall}));
    EXPECT_FALSE(innovations.add({t + 0.001, Vec3::Ones(), Vec3(1, 1, 0), AirClass::wall}));
    EXPECT_FALSE(innovations.add({t, Vec3::Ones(), Vec3::Ones(), AirClass::wall}));
    EXPECT_FALSE(innovations.add({nan, Vec3::Ones(), Vec3::Ones(), AirClass::wall}));
  }
  EXPECT_EQ(innovations.refused(), 200u);
}

TEST(Innovations, AfterAGapAndAcrossClassesNothingIsForetold) {
  Innovations innovations({});
  double t = 0;
  const auto told = [&](int samples, double dt, AirClass air) {
    int count = 0;
    for (int k = 0; k < samples; ++k) count += innovations.add({t += dt, Vec3::Ones(), Vec3::Ones(), air}).has_value();
    return count;
  };
  EXPECT_EQ(told(31, 0.02, AirClass::wall), 9);  // a sample begins, ten groups of three, of which the first foretells
  EXPECT_EQ(told(1, 0.3, AirClass::wall), 0);    // begins again
  EXPECT_EQ(told(30, 0.02, AirClass::wall), 9);
  EXPECT_EQ(told(1, 0.02, AirClass::wall), 0);
  EXPECT_EQ(told(2, 0.02, AirClass::ground), 0);  // a group of both classes
  EXPECT_EQ(told(30, 0.02, AirClass::ground), 10);
  EXPECT_EQ(told(1, 0.6, AirClass::ground), 0);
  EXPECT_EQ(told(30, 0.1, AirClass::ground), 29);  // each sample of 10 Hz is a group
}

}  // namespace
}  // namespace backwash::adapt

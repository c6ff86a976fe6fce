// SPDX-License-Identifier: BSD-3-Clause
// Short forms of tests/nightly/adapt.sh.
#include "tests/gusts/flights.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace {

using namespace gusts;

/// Flights of which each has its own seed and its own τ in the calibrated interval.
std::vector<Learned> fly_many(Trial trial, int flights) {
  std::vector<Learned> learned;
  for (int k = 0; k < flights; ++k) {
    trial.seed = 4000 + static_cast<std::uint64_t>(k);
    trial.tau_s = trial.tau_low_s + (trial.tau_high_s - trial.tau_low_s) * k / flights;
    learned.push_back(fly(trial));
  }
  return learned;
}
long alarms(const Trial& trial, int flights) {
  return std::ranges::count_if(fly_many(trial, flights), [](const auto& l) { return l.alarm_s.has_value(); });
}
/// Of the exposure until it is called rougher, s.
double middle(const Trial& trial, int flights) {
  std::vector<double> exposed;
  for (const auto& learned : fly_many(trial, flights)) exposed.push_back(learned.exposed_s.value_or(1e9));
  std::ranges::sort(exposed);
  return exposed[exposed.size() / 2];
}

Trial calm(Form form) {
  Trial trial;
  trial.form = form, trial.form_told = true, trial.tau_low_s = 0.14, trial.tau_high_s = 0.16, trial.jitter = 0.1;
  return trial;
}

TEST(AdaptFlights, GaussianAirAsModelledIsNotCalledRougher) {
  for (const Form form : kForms) EXPECT_LE(alarms(calm(form), 40), 1) << static_cast<int>(form);
}

TEST(AdaptFlights, BurstsOfTheSameVarianceAreNotCalledRougher) {
  auto trial = calm(Form::first_order);
  trial.form_told = false, trial.bursts.ln_kurtosis = 0.4;
  EXPECT_LE(alarms(trial, 100), 2);
}

TEST(AdaptFlights, NeitherRateNorSensorNoiseNorASteadyPushMakesItRougher) {
  auto trial = calm(Form::first_order);
  for (const double rate : {10.0, 20.0, 200.0}) {
    trial.rate_hz = rate;
    EXPECT_LE(alarms(trial, 30), 1) << rate;
  }
  trial = calm(Form::first_order), trial.noise = 0.08;  // 1.6 times the air's variance
  EXPECT_LE(alarms(trial, 30), 1);
  trial = calm(Form::first_order), trial.push = 0.2;  // three of the air's deviations
  EXPECT_LE(alarms(trial, 30), 1);
}

TEST(AdaptFlights, TwiceTheVarianceIsFoundWithinSeconds) {
  for (const Form form : kForms) {
    auto trial = calm(form);
    trial.factor = 2, trial.seconds = 30;
    EXPECT_LT(middle(trial, 20), 3.5) << static_cast<int>(form);
    trial.since_s = 30, trial.seconds = 60;
    EXPECT_LT(middle(trial, 20), 5.5) << static_cast<int>(form);
  }
}

TEST(AdaptFlights, FourTimesTheVarianceInMidFlightIsFoundWithinTwoSeconds) {
  auto trial = calm(Form::first_order);
  trial.factor = 4, trial.since_s = 30, trial.seconds = 45;
  EXPECT_LT(middle(trial, 20), 2);
}

TEST(AdaptFlights, WhatIsRoughNearWallsIsToldOfWallsAlone) {
  auto trial = calm(Form::karman);
  trial.factor = 2, trial.walls_only = true, trial.seconds = 60;
  EXPECT_LT(middle(trial, 20), 3.5);
  for (const auto& learned : fly_many(trial, 10)) {
    EXPECT_GT(learned.factor, 1.1);
    EXPECT_LT(learned.factor, 2.01);
    ASSERT_TRUE(learned.alarm_s);
    EXPECT_GE(*learned.alarm_s, 6);  // where the first wall begins
  }
}

TEST(AdaptFlights, TheSameSamplesTeachTheSameBitForBit) {
  auto trial = calm(Form::karman);
  trial.factor = 3, trial.seconds = 20;
  const auto once = fly(trial), again = fly(trial);
  EXPECT_EQ(once.alarm_s, again.alarm_s);
  EXPECT_EQ(once.factor, again.factor);
}

}  // namespace

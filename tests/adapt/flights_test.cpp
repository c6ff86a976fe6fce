// SPDX-License-Identifier: BSD-3-Clause
// Short forms of adapt_gate (tests/gusts).
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/gusts/flown_loop.hpp"

namespace {

using namespace gusts;
using backwash::adapt::Cause;

std::vector<Learned> fly_many(Trial trial, int flights, const Controller& controller = quad_5in()) {
  std::vector<Learned> learned;
  for (int k = 0; k < flights; ++k) {
    trial.seed = 4000 + static_cast<std::uint64_t>(k);
    learned.push_back(fly(controller, trial));
  }
  return learned;
}
long alarms(const Trial& trial, int flights) {
  return std::ranges::count_if(fly_many(trial, flights), [](const auto& l) { return l.alarm_s.has_value(); });
}
/// Of the exposure until it is called rougher, s.
double middle(const Trial& trial, int flights, const Controller& controller = quad_5in()) {
  std::vector<double> exposed;
  for (const auto& learned : fly_many(trial, flights, controller)) exposed.push_back(learned.exposed_s.value_or(1e9));
  std::ranges::sort(exposed);
  return exposed[exposed.size() / 2];
}

TEST(AdaptFlights, AirAsModelledIsNotCalledRougherWhateverItsFormAndItsTails) {
  for (const Form form : kForms) {
    Trial trial;
    trial.form = form;
    EXPECT_LE(alarms(trial, 40), 2) << static_cast<int>(form);
  }
  Trial bursts;
  bursts.bursts.ln_kurtosis = 0.4;
  EXPECT_LE(alarms(bursts, 40), 2);
}

TEST(AdaptFlights, RougherAirIsFoundAndSaidToBeTheAir) {
  Trial trial;
  trial.factor = 2;
  EXPECT_LT(middle(trial, 20), 30);
  trial.factor = 4;
  EXPECT_LT(middle(trial, 20), 12);
  EXPECT_LT(middle(trial, 20, px4()), 25);
  for (const auto& learned : fly_many(trial, 10)) {
    EXPECT_EQ(learned.cause, Cause::air);
    EXPECT_GT(learned.factor, 1.9);
    EXPECT_LT(learned.factor, 4.01);
    EXPECT_GT(learned.air_kept, 1.6);
  }
  trial.since_s = 60;
  EXPECT_LT(middle(trial, 20), 15);
  trial.factor = 16;
  trial.since_s = 0;
  for (const auto& learned : fly_many(trial, 10)) EXPECT_GT(learned.factor, 9.5);
}

TEST(AdaptFlights, WhatIsRoughNearWallsIsToldOfWallsAlone) {
  Trial trial;
  trial.factor = 6;
  trial.walls_only = true;
  trial.seconds = 180;
  for (const auto& learned : fly_many(trial, 10)) {
    EXPECT_GT(learned.factor, 1.1);
    EXPECT_LT(learned.factor, 6.01);
    ASSERT_TRUE(learned.alarm_s);
    EXPECT_GE(*learned.alarm_s, 6) << "where the first wall begins";
  }
}

TEST(AdaptFlights, WhatIsNotTheAirIsNotCalledTheAirAndOutlivesNoFlight) {
  struct Fault {
    const char* name;
    Trial trial;
    Cause cause;
  };
  std::vector<Fault> faults(6);
  faults[0] = {"load", {}, Cause::constant};
  faults[0].trial.load = 0.05;
  faults[1] = {"push", {}, Cause::constant};
  faults[1].trial.push = 0.5;
  faults[2] = {"late measurements", {}, Cause::motion};
  faults[2].trial.delay = 0.1;
  faults[3] = {"late set-points", {}, Cause::motion};
  faults[3].trial.command_delay = 0.1;
  faults[4] = {"lag", {}, Cause::motion};
  faults[4].trial.lag = 0.15;
  faults[5] = {"vibration", {}, Cause::none};
  faults[5].trial.vibration = 0.003;
  for (const auto& fault : faults)
    for (const auto& controller : {quad_5in(), px4()}) {
      int said = 0;
      for (const auto& learned : fly_many(fault.trial, 10, controller)) {
        EXPECT_FALSE(learned.air) << fault.name;
        EXPECT_EQ(learned.air_kept, 1) << fault.name;
        said += learned.cause == fault.cause;
      }
      EXPECT_GE(said, 5) << fault.name << ", kp " << controller.kp.horizontal;
    }
}

TEST(AdaptFlights, WhereNothingIsCommandedItCannotTellWhy) {
  Trial trial;
  trial.factor = 4;
  trial.speed = 0;
  for (const auto& learned : fly_many(trial, 10)) {
    EXPECT_EQ(learned.cause, Cause::unknown);
    EXPECT_GT(learned.factor, 1.9) << "sets grow all the same";
    EXPECT_EQ(learned.air_kept, 1);
  }
}

TEST(AdaptFlights, ShorterGustsThanCalibratedAreNeverRougherAndCalmerOfOneClass) {
  Trial trial;
  trial.tau_s = 0.05;
  for (const auto& learned : fly_many(trial, 20)) {
    EXPECT_FALSE(learned.alarm_s);
    EXPECT_TRUE(learned.calmer) << "errors are a third of what is promised";
  }
}

TEST(AdaptFlights, CountsErrorsBeyondALevelBesideWhatWasPromised) {
  double beyond = 0, promised = 0;
  Trial trial;
  for (const auto& learned : fly_many(trial, 40)) {
    beyond += learned.beyond;
    promised += learned.promised;
  }
  EXPECT_NEAR(beyond / promised, 1, 0.25);
  trial.factor = 4;
  for (const auto& learned : fly_many(trial, 3)) EXPECT_GT(learned.beyond, 5 * learned.promised);
}

}  // namespace

// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/control_error.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/adapt/remainder.hpp"
#include "tests/gusts/flown_loop.hpp"

namespace backwash::adapt {
namespace {

Vehicle vehicle_of(const gusts::Controller& controller) {
  Vehicle vehicle;
  vehicle.controller = controller;
  return vehicle;
}

std::vector<ErrorSample> samples(const gusts::Controller& controller, const gusts::Trial& trial) {
  ControlError error(vehicle_of(controller), {trial.tau_low_s, trial.tau_high_s, 0, 0});
  gusts::FlownLoop loop(controller, trial);
  std::vector<ErrorSample> all;
  while (loop.t() < trial.seconds)
    if (const auto sample = error.add(loop.tick())) all.push_back(*sample);
  return all;
}
double mean_square(const std::vector<ErrorSample>& samples) {
  double sum = 0;
  for (const auto& s : samples) sum += s.e_W.cwiseAbs2().cwiseQuotient(s.promised + s.noise).mean();
  return sum / static_cast<double>(samples.size());
}

// Three loops of which one has a feedback delay; the simulation knows nothing of core/reach.
TEST(ControlError, OfALoopAsTheFileSaysItHasTheVarianceThatWasPromisedWhateverTheGusts) {
  auto late = gusts::quad_5in();
  late.feedback_delay = 0.03;
  for (const auto& controller : {gusts::quad_5in(), late, gusts::px4()})
    for (const gusts::Form form : gusts::kForms) {
      gusts::Trial trial;
      trial.form = form;
      trial.seconds = 1500;
      EXPECT_NEAR(mean_square(samples(controller, trial)), 1, 0.12)
          << controller.kp.horizontal << ", form " << static_cast<int>(form);
    }
}

TEST(ControlError, OneSampleTellsLittleOfTheNext) {
  for (const auto& controller : {gusts::quad_5in(), gusts::px4()}) {
    gusts::Trial trial;
    trial.seconds = 1500;
    const auto all = samples(controller, trial);
    ASSERT_GT(all.size(), 500u);
    double with_next = 0, squares = 0;
    for (std::size_t k = 1; k < all.size(); ++k) {
      with_next += all[k].e_W.dot(all[k - 1].e_W);
      squares += all[k].e_W.squaredNorm();
    }
    EXPECT_LT(std::abs(with_next / squares), ControlError::kForgotten + 0.03);
  }
}

TEST(ControlError, NeitherNoiseNorVibrationNorTheRateOfTheOdometryIsAnError) {
  for (const double rate : {50.0, 30.0, 16.7}) {
    gusts::Trial trial;
    trial.seconds = 1000;
    trial.rate_hz = rate;
    trial.position_noise = 0.004;
    trial.velocity_noise = 0.05;
    const auto noisy = samples(gusts::quad_5in(), trial);
    EXPECT_NEAR(mean_square(noisy), 1, 0.12) << rate;
    EXPECT_NEAR(std::sqrt(noisy.back().noise.x()), 0.004, 0.0006) << rate;
  }
  gusts::Trial trial;
  trial.seconds = 1000;
  trial.vibration = 0.004;
  EXPECT_LT(mean_square(samples(gusts::quad_5in(), trial)), 1.1);
}

// What is late by its stamp is compared with where the centre was then.
TEST(ControlError, AnOdometryThatIsLateIsHeldAgainstItsOwnTime) {
  gusts::Trial trial;
  trial.seconds = 300;
  gusts::FlownLoop loop(gusts::quad_5in(), trial);
  ControlError error(vehicle_of(gusts::quad_5in()), {});
  std::vector<ErrorSample> all;
  std::vector<AirTick> ticks;
  while (loop.t() < trial.seconds) {
    ticks.push_back(loop.tick());
    if (ticks.size() < 4) continue;
    AirTick tick = ticks.back();
    tick.state = ticks[ticks.size() - 4].state;
    tick.age_s = 0.06;
    if (const auto sample = error.add(tick)) all.push_back(*sample);
  }
  EXPECT_NEAR(mean_square(all), 1, 0.2);
}

TEST(ControlError, AfterAGapAClockThatIsSetAndInAnotherFrameItSettlesFirst) {
  for (int fault = 0; fault < 4; ++fault) {
    gusts::FlownLoop loop(gusts::quad_5in(), {});
    ControlError error(vehicle_of(gusts::quad_5in()), {});
    std::int64_t shift = 0;
    double quiet = 0, longest = 0;
    for (int n = 1; n < 3000; ++n) {
      AirTick tick = loop.tick();
      if (n > 1000 && fault == 0) shift = -7'000'000'000;
      if (n > 1000 && fault == 1) shift = 400'000'000;
      if (n > 1000 && fault == 2) tick.frame = 1;
      if (n == 1000 && fault == 3) tick.command.p_W.x() = std::nan("");
      tick.now_ns += shift;
      const auto sample = error.add(tick);
      quiet = sample ? 0 : quiet + kControlPeriod;
      if (n > 500) longest = std::max(longest, quiet);
      EXPECT_LT(sample ? sample->e_W.norm() : 0, 0.05);
    }
    EXPECT_GT(longest, 1.5 * error.spacing_s()) << fault;
    EXPECT_LT(longest, 6) << fault;
  }
}

TEST(ControlError, WhatAFlightBeginsWithIsForgottenBeforeTheFirstSample) {
  for (const auto& controller : {gusts::quad_5in(), gusts::px4()}) {
    ControlError error(vehicle_of(controller), {});
    gusts::FlownLoop loop(controller, {});
    AirTick tick = loop.tick();
    tick.state.v_W += Vec3(1, 1, 1);
    auto sample = error.add(tick);
    for (int n = 0; n < 1000 && !sample; ++n) sample = error.add(loop.tick());
    ASSERT_TRUE(sample);
    EXPECT_LT(sample->e_W.cwiseAbs2().cwiseQuotient(sample->promised).maxCoeff(), 16);
  }
}

TEST(ControlError, ASampleOfTwoClassesIsOfNone) {
  gusts::Trial trial;
  trial.walls_only = true;
  int named = 0, mixed = 0;
  for (const auto& s : samples(gusts::quad_5in(), trial)) ++(s.air ? named : mixed);
  EXPECT_NEAR(mixed, 24, 2) << "twice in ten seconds";
  EXPECT_GT(named, 80);
}

// Of a delay, a lag, a load and a push the remainder holds little, in whatever direction it was flown.
TEST(Remainder, IsWhatNeitherAConstantNorTheCommandedMotionExplains) {
  const auto left = [](const gusts::Trial& trial, bool motion) {
    const Vec3 kp(10, 10, 12);
    Remainder remainder(kp, motion);
    std::vector<ErrorSample> all;
    for (const auto& s : samples(gusts::quad_5in(), trial)) all.push_back(remainder.add(s));
    return mean_square(all);
  };
  gusts::Trial load, push, delay, late;
  load.load = 0.05;
  push.push = 0.5;
  delay.delay = 0.1;
  late.command_delay = 0.1;
  for (const auto& trial : {load, push}) {
    EXPECT_GT(mean_square(samples(gusts::quad_5in(), trial)), 10);
    EXPECT_LT(left(trial, false), 1.5);
  }
  for (const auto& trial : {delay, late}) {
    EXPECT_GT(left(trial, false), 20);
    EXPECT_LT(left(trial, true), 2.5);
  }
}

}  // namespace
}  // namespace backwash::adapt

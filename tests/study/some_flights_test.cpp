// SPDX-License-Identifier: BSD-3-Clause
// Causes that act in some of twelve flights (rates: study_shares, docs/measurements/study.md).
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "core/study/findings/where_it_acts.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/study_worlds/shares.hpp"

namespace backwash::study {
namespace {

const std::filesystem::path& folder() {
  static const struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("some-flights-" + std::to_string(::getpid()));
    ~Folder() { std::filesystem::remove_all(path); }
  } made;
  return made.path;
}

TEST(SomeFlights, ARotorThatReadsHalfInSomeFlightsIsToldWithItsFlights) {
  for (const auto& [layout, count] : {std::pair("run", 4), {"any", 6}, {"any", 8}}) {
    const auto told = study_worlds::score(study_worlds::SharedFault{"rpm", count, layout, 1}, 4711, folder());
    EXPECT_TRUE(told.exact() && told.rotor && !told.wrong) << layout << " " << count << ": " << told.told;
  }
}

TEST(SomeFlights, AFaultThatBeginsWithinAFlightIsToldWithItsMoment) {
  const auto told = study_worlds::score(study_worlds::SharedFault{"rpm", 4, "since", 1}, 4712, folder());
  EXPECT_TRUE(told.exact()) << told.told;
  EXPECT_NEAR(told.told_since_s, told.since_s, 3) << told.told;
}

TEST(SomeFlights, ADamagedPropellersLineIsNoVibrationOfTheOtherFlights) {
  const auto told = study_worlds::score(study_worlds::SharedFault{"propeller_damage", 4, "run", 1}, 880002, folder());
  EXPECT_TRUE(told.exact() && told.rotor && !told.wrong) << told.told;
}

TEST(SomeFlights, ACauseOfAllFlightsIsNotDivided) {
  for (const char* cause : {"rotor_sensor_fault", "propeller_damage", "payload", "trim", "draft"}) {
    const auto world = study_worlds::draw_world({4711, {cause}, 1.5, 12, ""});
    auto options = study_worlds::with_reference(world, folder());
    options.minimum_detectable = options.dependence = false;
    for (const auto& named : study(study_worlds::observe(world, folder()), options).causes)
      EXPECT_TRUE(named.flights.empty()) << cause << ": " << named.found.form->cause() << ", " << where(named);
  }
}

TEST(SomeFlights, WhatActsInSomeFlightsDoesNotJoinTheModel) {
  study_worlds::Request request{4711, {"propeller_damage"}, 4, 12, "", {6, 7, 8, 9, 10, 11}};
  const auto world = study_worlds::draw_world(request);
  auto options = study_worlds::with_reference(world, folder());
  options.minimum_detectable = options.dependence = false;
  const auto result = study(study_worlds::observe(world, folder()), options);
  ASSERT_EQ(result.causes.size(), 1u) << study_worlds::told(result);
  const auto& cause = result.causes.front();
  EXPECT_EQ(cause.found.form->cause(), "propeller_damage");
  EXPECT_TRUE(where(cause).ends_with(", flights 7-12")) << where(cause);
  EXPECT_FALSE(cause.applied.refused.empty());
  EXPECT_GT(cause.gain.held_out_nats, 0);
  EXPECT_LT(cause.gain.rmse_after, cause.gain.rmse_before);
  const double truth = 1 / (1 - world.effects.of("propeller_damage")) - 1;
  EXPECT_NEAR(cause.found.parameters[0].value, truth, 0.2 * std::abs(truth));
}

/// −1.23 was told of a rotor that reads 0.54 of its speed: ln 0.54², as if it were 0.54² − 1.
TEST(SomeFlights, TellSharesAsShares) {
  const auto form = [](const std::string& cause) {
    for (const Form* f : catalogue())
      if (f->cause() == cause && f->integer_scale) return f;
    throw std::logic_error(cause);
  };
  const Windows windows(3);
  Accepted rotor{}, weight{};
  rotor.columns = form("rotor_sensor_fault")->columns(windows, Scale());
  weight.columns = form("payload")->columns(windows, Scale());
  rotor.parameters = {{"e", 2 * std::log(0.54), 2 * std::log(0.5), 0}, {"rotor", 3, 3, 3}};
  rotor = tell_shares(rotor);
  EXPECT_NEAR(rotor.parameters[0].value, 0.54 * 0.54 - 1, 1e-12);
  EXPECT_NEAR(rotor.parameters[0].low, -0.75, 1e-12);
  EXPECT_EQ(rotor.parameters[1].value, 3);
  weight.parameters = {{"m_first", std::log(1.2 / 0.8) / 2, 0, 0}, {"m_second", 0, 0, 0}, {"pairing", 2, 2, 2}};
  weight = tell_shares(weight);
  EXPECT_NEAR(weight.parameters[0].value, 0.2, 1e-12) << "(1 + m) and (1 - m) of the mean";
}

TEST(SomeFlights, AreWrittenAsRunsWithTheMomentsOfTheirSteps) {
  NamedCause cause{};
  cause.found.parameters = {{"d", 0.1, 0, 0.2}, {"rotor", 3, 3, 3}};
  EXPECT_EQ(where(cause), "");
  cause.flights = {{4, 34.2, {}}, {5}, {6}, {7}};
  EXPECT_EQ(where(cause), "rotor 3, flights 5-8, since 34 s in flight 5");
  cause.flights = {{0}, {1}, {3}, {7, {}, 12.0}};
  EXPECT_EQ(where(cause), "rotor 3, flights 1, 2, 4, 8, until 12 s in flight 8");
}

}  // namespace
}  // namespace backwash::study

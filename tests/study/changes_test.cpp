// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <random>

#include "core/study/findings/when_it_acts.hpp"
#include "core/study/findings/words.hpp"
#include "core/study/inference/changes/divisions.hpp"
#include "core/study/inference/rules.hpp"
#include "core/study/windows/signals/distributions.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/study_worlds/shares.hpp"

namespace backwash::study {
namespace {

/// Values of flights of which the windows' noise is `error`.
FlightValues values_of(const std::vector<double>& values, double error = 1e-6) {
  const auto n = static_cast<Eigen::Index>(values.size());
  FlightValues all{Eigen::MatrixXd(1, n), Eigen::VectorXd::Constant(n, error * error)};
  for (Eigen::Index f = 0; f < n; ++f) all.of(0, f) = values[static_cast<std::size_t>(f)];
  return all;
}

const Division& clearest(const std::vector<Division>& all) { return *std::ranges::min_element(all, {}, &Division::p); }

Division of_kind(const FlightValues& values, When when) {
  for (const auto& d : divisions(values))
    if (d.when == when) return d;
  throw std::logic_error("no such division");
}

std::vector<double> drawn(std::mt19937& rng, const std::function<double(std::mt19937&)>& value, int flights = 12) {
  std::vector<double> all;
  for (int f = 0; f < flights; ++f) all.push_back(value(rng));
  return all;
}

/// What no change should be found in, however flights scatter.
TEST(Divisions, FlightsOnOneLevelChangeNoMoreOftenThanTheLevelSays) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> even(-1, 1);
  const std::vector<std::pair<const char*, std::function<double(std::mt19937&)>>> scatters = {
      {"normal", [&](auto& rng) { return normal(rng); }}, {"even", [&](auto& rng) { return even(rng); }}};
  for (const auto& [name, value] : scatters) {
    std::mt19937 rng(7);
    int changed = 0;
    constexpr int kTrials = 3000;
    for (int k = 0; k < kTrials; ++k)
      changed += kWhens * clearest(divisions(values_of(drawn(rng, value)))).p <= 0.05 ? 1 : 0;
    EXPECT_LE(changed, 0.05 * kTrials) << name;
    EXPECT_GT(changed, 0) << name << ": a level that is never passed says nothing";
  }
}

TEST(Divisions, FindTheFlightsWhetherTheyFollowEachOtherOrNot) {
  std::mt19937 rng(3);
  std::normal_distribution<double> scatter(0, 0.01);
  const std::vector<std::pair<std::vector<double>, When>> sets = {{{0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1}, When::from},
                                                                  {{0, 0, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0}, When::run},
                                                                  {{1, 0, 1, 0, 0, 1, 1, 0, 1, 0, 1, 0}, When::any}};
  for (const auto& [high, when] : sets) {
    std::vector<double> values;
    for (const double h : high) values.push_back(0.3 * h - 0.1 + scatter(rng));
    const Division found = clearest(divisions(values_of(values)));
    EXPECT_EQ(found.when, when);
    EXPECT_LT(found.p, 1e-4);
    const double sign = found.added(0, 0) > 0 ? 1 : -1;
    for (std::size_t f = 0; f < high.size(); ++f)
      EXPECT_EQ(sign > 0 ? high[f] : 1 - high[f], found.profile(0, static_cast<Eigen::Index>(f))) << f;
    EXPECT_NEAR(sign * found.added(0, 0), 0.3, 0.02);
  }
}

/// It has no scatter of its own, wherever it was flown.
TEST(Divisions, OneFlightAloneIsNone) {
  for (std::size_t odd = 0; odd < 12; ++odd) {
    std::vector<double> values(12, 0.0);
    for (std::size_t f = 0; f < values.size(); ++f) values[f] = f == odd ? 1 : 0.001 * static_cast<double>(f % 3);
    for (const auto& d : divisions(values_of(values)))
      for (const auto& row : d.profile.rowwise())
        if (d.when != When::growing) {
          EXPECT_GE(row.sum(), 2) << odd;
          EXPECT_LE(row.sum(), 10) << odd;
        }
  }
}

TEST(Divisions, TwoStepsAreTwoOnlyIfEachIsClear) {
  std::mt19937 rng(4);
  std::normal_distribution<double> scatter(0, 0.01);
  int told = 0, twice = 0;
  for (int k = 0; k < 50; ++k) {
    std::vector<double> thirds, once;
    for (int f = 0; f < 12; ++f) {
      thirds.push_back(0.12 - 0.06 * (f / 4) + scatter(rng));
      once.push_back((f < 6 ? 0.12 : 0) + scatter(rng));
    }
    for (const auto& d : divisions(values_of(thirds))) {
      if (d.when != When::steps) continue;
      bool exact = true;
      for (Eigen::Index f = 0; f < 12; ++f)
        exact = exact && d.profile(0, f) == (f >= 4 ? 1 : 0) && d.profile(1, f) == (f >= 8 ? 1 : 0);
      told += exact && std::abs(d.added(0, 0) + 0.06) < 0.03 ? 1 : 0;
    }
    for (const auto& d : divisions(values_of(once))) twice += d.when == When::steps ? 1 : 0;
  }
  EXPECT_GE(told, 45) << "of 50 with two";
  EXPECT_LE(twice, 2) << "of 50 with one step";
}

TEST(Divisions, WhatGrowsIsNoStep) {
  std::mt19937 rng(5);
  std::normal_distribution<double> scatter(0, 0.3);
  std::vector<double> values;
  for (int f = 0; f < 12; ++f) values.push_back(f + scatter(rng));
  const Division found = clearest(divisions(values_of(values)));
  EXPECT_EQ(found.when, When::growing);
  EXPECT_NEAR(found.added(0, 0), 11, 0.6) << "from the first flight to the last";
}

/// Student's test of two means, both sides.
double students_p(const std::vector<double>& values, std::size_t from) {
  const double n = static_cast<double>(values.size()), a = static_cast<double>(from), b = n - a;
  double mean[2] = {}, square = 0;
  for (std::size_t f = 0; f < values.size(); ++f) mean[f >= from] += values[f] / (f >= from ? b : a);
  for (std::size_t f = 0; f < values.size(); ++f) square += std::pow(values[f] - mean[f >= from], 2);
  return 2 * student_tail(std::abs(mean[1] - mean[0]) / std::sqrt(square / (n - 2) * (1 / a + 1 / b)), n - 2);
}

TEST(Divisions, AreJudgedAsStudentDoesOverAllThatIsTried) {
  std::mt19937 rng(11);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 100; ++trial) {
    auto values = drawn(
        rng, [&](auto& r) { return normal(r); }, 6 + trial % 12);
    for (std::size_t f = 3; f < values.size(); ++f) values[f] += trial % 5;
    double least = 1;
    for (std::size_t a = 2; a + 2 <= values.size(); ++a) least = std::min(least, students_p(values, a));
    const double expected = std::min(1.0, least * static_cast<double>(values.size() - 1));
    EXPECT_NEAR(of_kind(values_of(values), When::from).p, expected, 1e-6 * expected) << trial;
  }
}

TEST(Divisions, ALevelBelowTheErrorOfTheFlightsIsNone) {
  const std::vector<double> values = {0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1};
  EXPECT_LT(of_kind(values_of(values, 1e-3), When::from).p, 1e-9);
  EXPECT_GT(of_kind(values_of(values, 2), When::from).p, 0.5);
  EXPECT_TRUE(divisions(values_of({0, 0, 0, 1, 1})).empty()) << "two levels and a scatter need six";
}

TEST(Divisions, AFlightThatTellsLittleCountsLittle) {
  auto values = values_of({0, 0.1, -0.1, 0, 0.1, 9, 1, 1.1, 0.9, 1, 1.1, 0.9}, 0.05);
  const double before = of_kind(values, When::from).p;
  values.error2[5] = 100;
  const Division d = of_kind(values, When::from);
  EXPECT_LT(d.p, 0.01 * before);
  EXPECT_NEAR(d.added(0, 0), 1, 0.1);
}

/// Both level axes scatter alike: a step along one of them, in more flights than it has parameters, is as clear as
/// along any other line.
TEST(Divisions, TwoAxesAreAskedTogether) {
  std::mt19937 rng(13);
  std::normal_distribution<double> normal;
  FlightValues values{Eigen::MatrixXd(2, 12), Eigen::VectorXd::Constant(12, 1e-6)};
  for (Eigen::Index f = 0; f < 12; ++f) values.of.col(f) << normal(rng) + (f >= 6 ? 8 : 0), normal(rng);
  const double along = of_kind(values, When::from).p;
  const double turn = 0.7;
  Eigen::Matrix2d turned;
  turned << std::cos(turn), -std::sin(turn), std::sin(turn), std::cos(turn);
  const auto added = of_kind(values, When::from).added;
  EXPECT_LT(along, 1e-6);
  EXPECT_NEAR(added(0, 0), 8, 1.5);
  values.of = turned * values.of;
  const Division aside = of_kind(values, When::from);
  EXPECT_NEAR((turned.transpose() * aside.added)(0, 0), added(0, 0), 0.3);
  EXPECT_LT(aside.p, 1e-5);
}

/// Other amplitudes of the same flights say how much flights scatter: as much as their windows' noise, or nothing.
TEST(Divisions, AScatterThatOthersShareIsExpected) {
  std::mt19937 rng(17);
  std::normal_distribution<double> normal;
  std::vector<FlightValues> alike, unlike;
  for (int k = 0; k < 40; ++k) {
    const double scale = std::pow(10, k % 5), own = std::exp(2 * normal(rng));
    auto draw = [&](auto& r) { return scale * normal(r); };
    alike.push_back(values_of(drawn(rng, draw), scale));
    unlike.push_back(values_of(drawn(rng, draw), scale * own));
  }
  const Expected sure = expected(alike), unsure = expected(unlike);
  EXPECT_NEAR(sure.over, 1, 0.5);
  EXPECT_GT(sure.degrees, 20);
  EXPECT_LT(unsure.degrees, 5);
  int changed = 0;
  constexpr int kTrials = 2000;
  for (int k = 0; k < kTrials; ++k)
    changed +=
        kWhens * clearest(divisions(values_of(drawn(rng, [&](auto& r) { return normal(r); }), 1), sure)).p <= 0.05;
  EXPECT_LE(changed, 0.05 * kTrials);
}

TEST(Divisions, AMomentIsToldByTheFlightsDifferences) {
  std::mt19937 rng(19);
  std::normal_distribution<double> normal;
  const auto off = drawn(rng, [&](auto&r) { return 3 + normal(r); }),
             none = drawn(rng, [&](auto&r) { return normal(r); });
  double mean = 0, square = 0;
  for (const double x : off) mean += x / 12;
  for (const double x : off) square += (x - mean) * (x - mean) / 11;
  const double t = mean / std::sqrt(square / 12);
  const Division d = moment(values_of(off), 8);
  EXPECT_NEAR(d.p, 16 * student_tail(t, 11), 0.01 * d.p);
  EXPECT_NEAR(d.added(0, 0), mean, 1e-3);
  EXPECT_GT(moment(values_of(none), 8).p, 0.1);
}

/// The density of Student's t with one degree is 1/π/(1 + t²).
TEST(Divisions, StudentsTailIsThatOfTheDensity) {
  for (const double t : {0.0, 0.7, 3.0, 40.0})
    EXPECT_NEAR(student_tail(t, 1), 0.5 - std::atan(t) / std::numbers::pi, 1e-12) << t;
}

// Causes that act in some of twelve flights (rates: study_shares, docs/measurements/study.md).

const std::filesystem::path& folder() {
  static const struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("some-flights-" + std::to_string(::getpid()));
    ~Folder() { std::filesystem::remove_all(path); }
  } made;
  return made.path;
}

TEST(Changes, ARotorThatReadsHalfInSomeFlightsIsToldWithItsFlights) {
  for (const auto& [layout, count] : {std::pair("run", 4), {"any", 6}, {"any", 8}}) {
    const auto told = study_worlds::score(study_worlds::SharedFault{"rpm", count, layout, 1}, 4711, folder());
    EXPECT_TRUE(told.exact() && told.rotor && !told.wrong) << layout << " " << count << ": " << told.told;
  }
}

TEST(Changes, AFaultThatBeginsWithinAFlightIsToldWithItsMoment) {
  const auto told = study_worlds::score(study_worlds::SharedFault{"rpm", 4, "since", 1}, 4712, folder());
  EXPECT_TRUE(told.exact()) << told.told;
  EXPECT_NEAR(told.told_since_s, told.since_s, 3) << told.told;
}

TEST(Changes, ADamagedPropellersLineIsNoVibrationOfTheOtherFlights) {
  const auto told = study_worlds::score(study_worlds::SharedFault{"propeller_damage", 4, "run", 1}, 880002, folder());
  EXPECT_TRUE(told.exact() && told.rotor && !told.wrong) << told.told;
}

TEST(Changes, ACauseOfAllFlightsIsNotDivided) {
  for (const char* cause : {"rotor_sensor_fault", "propeller_damage", "payload", "trim", "draft"}) {
    const auto world = study_worlds::draw_world({4711, {cause}, 1.5, 12, ""});
    auto options = study_worlds::with_reference(world, folder());
    options.minimum_detectable = options.dependence = false;
    for (const auto& named : study(study_worlds::observe(world, folder()), options).causes)
      EXPECT_TRUE(named.flights.empty()) << cause << ": " << named.found.form->cause() << ", " << where(named);
  }
}

TEST(Changes, WhatActsInSomeFlightsDoesNotJoinTheModel) {
  study_worlds::Request request{4711, {"propeller_damage"}, 4, 12, "", {6, 7, 8, 9, 10, 11}};
  const auto world = study_worlds::draw_world(request);
  auto options = study_worlds::with_reference(world, folder());
  options.minimum_detectable = options.dependence = false;
  const auto result = study(study_worlds::observe(world, folder()), options);
  ASSERT_EQ(result.causes.size(), 1u) << study_worlds::told(result);
  const auto& cause = result.causes.front();
  EXPECT_EQ(cause.found.form->cause(), "propeller_damage");
  EXPECT_TRUE(where(cause).ends_with(", from flight 7 on")) << where(cause);
  EXPECT_FALSE(cause.applied.refused.empty());
  EXPECT_GT(cause.gain.held_out_nats, 0);
  EXPECT_LT(cause.gain.rmse_after, cause.gain.rmse_before);
  const double truth = 1 / (1 - world.effects.of("propeller_damage")) - 1;
  EXPECT_NEAR(cause.found.parameters[0].value, truth, 0.2 * std::abs(truth));
}

/// −1.23 was told of a rotor that reads 0.54 of its speed: ln 0.54², as if it were 0.54² − 1.
TEST(ItsWords, OfLogarithmsAreShares) {
  const auto form = [](const std::string& cause) {
    for (const Form* f : catalogue())
      if (f->cause() == cause && f->integer_scale) return f;
    throw std::logic_error(cause);
  };
  const Windows windows(3);
  Accepted rotor{}, weight{};
  rotor.form = form("rotor_sensor_fault");
  weight.form = form("payload");
  rotor.columns = form("rotor_sensor_fault")->columns(windows, Scale());
  weight.columns = form("payload")->columns(windows, Scale());
  rotor.parameters = {{"e", 2 * std::log(0.54), 2 * std::log(0.5), 0}, {"rotor", 3, 3, 3}};
  rotor = in_words(rotor);
  EXPECT_NEAR(rotor.parameters[0].value, 0.54 * 0.54 - 1, 1e-12);
  EXPECT_NEAR(rotor.parameters[0].low, -0.75, 1e-12);
  EXPECT_EQ(rotor.parameters[1].value, 3);
  weight.parameters = {{"m_first", std::log(1.2 / 0.8) / 2, 0, 0}, {"m_second", 0, 0, 0}, {"pairing", 2, 2, 2}};
  weight = in_words(weight);
  EXPECT_NEAR(weight.parameters[0].value, 0.2, 1e-12) << "(1 + m) and (1 - m) of the mean";
}

/// Mass of +12, +6 and 0 % by thirds of the campaign, wind from a flight on, a mass that is dropped in each flight.
TEST(Changes, AMassByThirdsOfTheCampaignIsToldWithItsSteps) {
  const auto world = [](double size) { return study_worlds::draw_world({4720, {"payload"}, size, 12, ""}); };
  const auto heavy = world(1);
  const double per_size = std::abs(heavy.effects.of("payload"));
  auto flights = study_worlds::fly_all(world(0.12 / per_size));
  const auto half = study_worlds::fly_all(world(0.06 / per_size)), none = study_worlds::fly_all(world(1e-9));
  for (std::size_t f = 4; f < 12; ++f) flights[f] = f < 8 ? half[f] : none[f];
  auto options = study_worlds::with_reference(heavy, folder());
  options.minimum_detectable = options.dependence = false;
  const auto result = study(study_worlds::observe(heavy, flights, folder()), options);
  std::vector<std::string> when;
  for (const auto& cause : result.causes) {
    EXPECT_EQ(cause.found.form->cause(), "payload") << study_worlds::told(result);
    if (!cause.when.empty()) when.push_back(cause.when);
  }
  EXPECT_EQ(when, (std::vector<std::string>{"from flight 5 on", "from flight 9 on"})) << study_worlds::told(result);
}

/// A share is missing of the thrust of the flights that carried it, and not of the mean over those without it as well.
TEST(Changes, AMassInHalfOfTheFlightsHasItsOwnSize) {
  const auto world = [](double size) { return study_worlds::draw_world({4720, {"payload"}, size, 12, ""}); };
  const auto heavy = world(1);
  auto flights = study_worlds::fly_all(world(0.3 / std::abs(heavy.effects.of("payload"))));
  const auto none = study_worlds::fly_all(world(1e-9));
  for (std::size_t f = 0; f < 6; ++f) flights[f] = none[f];
  auto options = study_worlds::with_reference(heavy, folder());
  options.minimum_detectable = options.dependence = false;
  const auto result = study(study_worlds::observe(heavy, flights, folder()), options);
  ASSERT_FALSE(result.causes.empty());
  ASSERT_EQ(result.causes[0].found.form->cause(), "payload") << study_worlds::told(result);
  EXPECT_EQ(result.causes[0].when, "from flight 7 on");
  const auto& m = result.causes[0].found.parameters[0];
  const double carried = std::copysign(0.3, heavy.effects.of("payload"));
  EXPECT_NEAR(m.value, carried, 0.02);
  EXPECT_LE(m.low, carried);
  EXPECT_GE(m.high, carried);
}

/// Every flight discharges alike: a mass and one more since a moment of each flight imitate the voltage.
TEST(Changes, AVoltageThatSagsAlikeInEachFlightIsNoStepOfTheMass) {
  const auto world = study_worlds::draw_world({1820000144, {"battery_sag"}, 1, 12, "battery"});
  auto options = study_worlds::with_reference(world, folder());
  options.minimum_detectable = options.dependence = false;
  const auto result = study(study_worlds::observe(world, folder()), options);
  ASSERT_EQ(result.causes.size(), 1u) << study_worlds::told(result);
  EXPECT_EQ(result.causes.front().found.form->cause(), "battery_sag") << study_worlds::told(result);
}

TEST(Changes, AreToldWithTheirFlightOrTheirMoment) {
  const auto from = study_worlds::score(study_worlds::SharedFault{"draft", 6, "from", 3}, 500, folder());
  EXPECT_TRUE(from.exact() && !from.wrong) << from.told;
  const auto each = study_worlds::score(study_worlds::SharedFault{"payload", 12, "each", 5}, 600, folder());
  EXPECT_TRUE(each.found && !each.wrong) << each.told;
  EXPECT_NEAR(each.told_since_s, each.since_s, 5) << each.told;
}

TEST(Changes, AreSaidInWords) {
  EXPECT_EQ(when(When::any, {{4, 34.2, {}}, {5}, {6}, {7}}, 9), "flights 5-8, since 34 s in flight 5");
  EXPECT_EQ(when(When::any, {{0}, {1}, {3}, {7, {}, 12.0}}, 9), "flights 1, 2, 4, 8, until 12 s in flight 8");
  EXPECT_EQ(when(When::from, {{6}, {7}, {8}}, 9), "from flight 7 on");
  EXPECT_EQ(when(When::from, {{0}, {1}, {2}}, 9), "up to flight 3");
  EXPECT_EQ(when(When::moment, {{0, 60.0, {}}, {1, 60.0, {}}}, 2), "since 60 s of each flight");
  EXPECT_EQ(when(When::growing, {{0}, {1}}, 2), "growing from flight to flight");
  NamedCause cause{};
  cause.found.parameters = {{"d", 0.1, 0, 0.2}, {"rotor", 3, 3, 3}};
  EXPECT_EQ(where(cause), "");
  cause.flights = {{0}};
  cause.when = "flight 1";
  EXPECT_EQ(where(cause), "rotor 3, flight 1");
}

}  // namespace
}  // namespace backwash::study

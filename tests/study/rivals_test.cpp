// SPDX-License-Identifier: BSD-3-Clause
// Causes that look alike, large sizes and ends of laws, and what an engineer is told to change.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/study/effects/columns.hpp"
#include "core/study/effects/table.hpp"
#include "core/study/findings/words.hpp"
#include "core/types/thrust.hpp"
#include "tests/study_worlds/observe.hpp"

namespace {

using namespace backwash;
using namespace backwash::study;

std::filesystem::path folder() {
  return std::filesystem::temp_directory_path() / ("study-rivals-" + std::to_string(::getpid()));
}

Observations world_with(const std::string& cause, double size, const std::string& confound, std::uint64_t seed) {
  const auto world = study_worlds::draw_world({seed, {cause}, size, 12, confound});
  auto seen = study_worlds::observe(world, folder());
  std::filesystem::remove_all(folder());
  return seen;
}

Observations quiet() { return world_with("payload", 1e-4, "", 4711); }

StudyResult studied(const Observations& seen) {
  StudyOptions options;
  options.minimum_detectable = options.dependence = false;
  return study::study(seen, options);
}

const Form& form_of(const std::string& cause) {
  return **std::find_if(catalogue().begin(), catalogue().end(), [&](auto* f) { return f->cause() == cause; });
}

bool in_every_set(const std::string& name, const StudyResult& result) {
  const auto sets = study_worlds::sets_of(result);
  return std::all_of(sets.begin(), sets.end(), [&](auto& s) { return std::find(s.begin(), s.end(), name) != s.end(); });
}

/// Correlation over the windows of one channel.
double correlation(const std::vector<DesignColumn>& a, const std::vector<DesignColumn>& b, Channel channel) {
  const auto of = [&](const std::vector<DesignColumn>& columns) {
    for (const auto& part : columns.front().parts)
      if (part.channel == channel) return part.x;
    return std::vector<double>();
  };
  const auto x = of(a), y = of(b);
  double n = 0, sx = 0, sy = 0, xx = 0, yy = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    n += 1;
    sx += x[i];
    sy += y[i];
    xx += x[i] * x[i];
    yy += y[i] * y[i];
    xy += x[i] * y[i];
  }
  return (xy - sx * sy / n) / std::sqrt((xx - sx * sx / n) * (yy - sy * sy / n));
}

TEST(Rivals, APushByHeightAndASteeperThrustMoveTogetherWhereTheCraftGoesUpAndDown) {
  const auto seen = world_with("thrust_slope", 2, "bob", 1795800002);
  const auto slope = form_of("thrust_slope").columns(seen.windows, {});
  const auto push = form_of("ground_thrust").columns(seen.windows, {0.3});
  EXPECT_GT(correlation(slope, push, kThrustSlope), 0.7) << "low where it is told to accelerate upwards";
  const auto result = studied(seen);
  ASSERT_FALSE(result.causes.empty());
  EXPECT_TRUE(in_every_set("thrust_slope", result)) << study_worlds::told(result);
}

/// The hidden drag is 0.2 1/s at rest and grows with the speed; 0.23 1/s at 1 m/s, 0.27 at the speeds flown.
TEST(Rivals, ASteeperThrustOfFlightsUpAndDownIsToldByTheTrendOfItsWindows) {
  // In 3 to 5 s once up and down: half of what was asked for is a trend within 2 s. Without it all four say nothing.
  for (const std::uint64_t seed : {1797000006, 1797000009, 1797000012, 1797000018}) {
    const auto result = studied(world_with("thrust_slope", 1, "bob", seed));
    EXPECT_FALSE(result.causes.empty()) << seed;
    EXPECT_TRUE(in_every_set("thrust_slope", result)) << seed << ": " << study_worlds::told(result);
  }
}

TEST(Sizes, ADragOfFastFlightsIsToldAtOneMetrePerSecond) {
  double mean = 0;
  for (const std::uint64_t seed : {1796030000, 1796030012, 1796030014}) {
    const auto result = studied(world_with("rotor_drag", 1, "fast", seed));
    ASSERT_EQ(result.causes.size(), 1u) << study_worlds::told(result);
    const Estimate& k = result.causes[0].found.parameters[0];
    mean += k.value / 3;
    EXPECT_LT(k.low, 0.23) << seed;
    EXPECT_GT(k.high, 0.23) << seed;
  }
  EXPECT_NEAR(mean, 0.23, 0.02);
}

TEST(Rivals, NeitherIsToldBesideTheOther) {
  for (const char* cause : {"thrust_slope", "ground_thrust"})
    for (const std::uint64_t seed : {1795800000, 1795800004}) {
      const auto result = studied(world_with(cause, 2, "bob", seed));
      EXPECT_EQ(result.causes.size(), 1u) << cause << ": " << study_worlds::told(result);
      EXPECT_TRUE(in_every_set(cause, result)) << cause << ": " << study_worlds::told(result);
    }
}

TEST(Rivals, AWrongAttitudeLagIsToldFromLateCommandsByTheLoggedTilt) {
  const auto lagging = studied(world_with("actuator_lag", 0.8, "attitude", 1795800002));
  ASSERT_EQ(lagging.verdict, StudyVerdict::cause_found) << study_worlds::told(lagging);
  const Accepted& lag = lagging.causes.front().found;
  EXPECT_EQ(lag.form->parameters.front(), "lag_s") << study_worlds::told(lagging);
  EXPECT_NEAR(lag.parameters.front().value, 0.04, 0.008);
  const auto late = studied(world_with("command_latency", 1.3, "", 1795800002));
  ASSERT_EQ(late.verdict, StudyVerdict::cause_found) << study_worlds::told(late);
  EXPECT_EQ(late.causes.front().found.form->cause(), "command_latency");
}

/// A load of this size in kg per kg on a craft whose rotors differ by 15 %, which nothing says to be sound.
StudyResult loaded(double size) {
  auto seen = world_with("payload", size, "", 4714);
  for (std::size_t i = 0; i < seen.windows.size(); ++i)
    for (std::size_t r = 0; r < 4; ++r) seen.y[kMotor1 + r][i] = r == 0 ? 0.06 : -0.02;
  return studied(seen);
}

TEST(Rivals, APayloadThatAWeakRotorMayExplainIsASetUntilSoundFlightsAreGiven) {
  const auto small = loaded(1), large = loaded(6);
  ASSERT_EQ(small.causes.size(), 1u) << study_worlds::told(small);
  EXPECT_EQ(small.verdict, StudyVerdict::cannot_distinguish) << study_worlds::told(small);
  EXPECT_TRUE(in_every_set("payload", small) && in_every_set("propeller_damage", small)) << study_worlds::told(small);
  EXPECT_FALSE(small.causes.front().separate_by.empty());
  ASSERT_EQ(large.causes.size(), 1u) << study_worlds::told(large);
  EXPECT_EQ(large.verdict, StudyVerdict::cause_found)
      << "no rotor that flies lost so much: " << study_worlds::told(large);
}

TEST(Rivals, WithoutTheTiltTheyAreOneSet) {
  auto seen = world_with("command_latency", 1.3, "", 1795800002);
  std::fill(seen.weight[kTiltDelay].begin(), seen.weight[kTiltDelay].end(), 0.0);
  const auto result = studied(seen);
  ASSERT_EQ(result.verdict, StudyVerdict::cannot_distinguish) << study_worlds::told(result);
  EXPECT_TRUE(in_every_set("actuator_lag", result) && in_every_set("command_latency", result))
      << study_worlds::told(result);
}

/// Flights in which the slope has the vertical mean alone, and its design there goes with a push by height at −0.94.
Observations moving_together(double push) {
  auto seen = quiet();
  for (const Channel c : {kThrustDelay, kThrustSlope}) std::fill(seen.weight[c].begin(), seen.weight[c].end(), 0.0);
  const auto by_height = form_of("ground_thrust").columns(seen.windows, {0.3}).front().parts.front().x;
  double mean = 0, square = 0;
  for (const double x : by_height) mean += x / static_cast<double>(by_height.size());
  for (const double x : by_height) square += (x - mean) * (x - mean) / static_cast<double>(by_height.size());
  std::mt19937 rng(7);
  std::normal_distribution<double> draw;
  for (std::size_t i = 0; i < by_height.size(); ++i) {
    auto& w = seen.windows[i];
    w.mean_gain = {0, -0.94 * (by_height[i] - mean) / std::sqrt(square) + std::sqrt(1 - 0.94 * 0.94) * draw(rng)};
    seen.y[kMeanZ][i] += push * by_height[i];
  }
  return seen;
}

TEST(Rivals, ThatGoTogetherAtMinus094AreOneSetHoweverStrong) {
  for (const double push : {0.2, 0.6}) {
    const auto result = studied(moving_together(push));
    EXPECT_EQ(result.verdict, StudyVerdict::cannot_distinguish) << push << ": " << study_worlds::told(result);
    ASSERT_FALSE(result.causes.empty());
    EXPECT_TRUE(in_every_set("ground_thrust", result)) << push << ": " << study_worlds::told(result);
    EXPECT_TRUE(in_every_set("thrust_slope", result)) << push << ": " << study_worlds::told(result);
  }
}

TEST(Plausible, EveryParameterHasATypicalSizeAndAReasonForEachEnd) {
  for (const Form* f : catalogue()) {
    ASSERT_EQ(f->priors.size(), f->parameters.size()) << f->formula;
    for (const Prior& p : f->priors) {
      EXPECT_GT(p.typical, 0) << f->formula;
      EXPECT_LT(p.least, p.most) << f->formula;
      EXPECT_EQ(std::isfinite(p.least) || std::isfinite(p.most), !p.reason.empty()) << f->formula;
    }
  }
}

TEST(Plausible, ASizeCostsWhatCauchysDensityLosesAndNoMoreInOneDirectionThanInAnother) {
  const auto density = [](double x) { return 1 / (1 + x * x); };
  const Form &sag = form_of("battery_sag"), &draft = form_of("draft");
  for (const double size : {0.3, -2.0, 40.0}) {
    const double one[] = {size}, expected = -std::log(density(size / sag.priors[0].typical));
    EXPECT_NEAR(sag.prior_nats(one), expected, 1e-12);
    const double along[] = {size, 0}, across[] = {size * std::sqrt(0.5), -size * std::sqrt(0.5)};
    EXPECT_NEAR(draft.prior_nats(along), draft.prior_nats(across), 1e-12);
  }
}

/// What stands in the logs is a cause of this size and nothing else.
StudyResult with_only(const std::string& cause, const std::vector<double>& size) {
  auto seen = quiet();
  const auto columns = form_of(cause).columns(seen.windows, form_of(cause).scales.front());
  for (std::size_t k = 0; k < size.size(); ++k)
    for (const auto& part : columns[k].parts)
      for (std::size_t i = 0; i < part.x.size(); ++i) seen.y[part.channel][i] += size[k] * part.x[i];
  return studied(seen);
}

TEST(Plausible, WhatFlightsShowPlainlyIsToldHoweverLargeAndAsLarge) {
  const std::vector<std::pair<std::string, std::vector<double>>> sizes = {
      {"draft", {-7, 4}}, {"trim", {5, 5}}, {"thrust_slope", {4}}, {"battery_sag", {40}}, {"payload", {0.62}}};
  for (const auto& [cause, size] : sizes) {
    const auto result = with_only(cause, size);
    ASSERT_EQ(result.causes.size(), 1u) << cause << ": " << study_worlds::told(result);
    const Accepted& found = result.causes.front().found;
    EXPECT_EQ(found.form->cause(), cause) << study_worlds::told(result);
    EXPECT_NEAR(found.theta[0], size[0], 0.1 * std::abs(size[0])) << cause;
    EXPECT_GT(prior_nats_of(found), std::log(10)) << cause;
    EXPECT_NE(beforehand(found).find(" times what is typical: 1 to "), std::string::npos) << beforehand(found);
  }
}

TEST(Plausible, BeyondTheEndOfItsLawACauseIsRefusedByName) {
  const auto result = with_only("payload", {1.3});
  for (const auto& cause : result.causes) EXPECT_NE(cause.found.form->cause(), "payload") << study_worlds::told(result);
  ASSERT_FALSE(result.refused.empty()) << study_worlds::told(result);
  EXPECT_EQ(result.refused.front().name, "payload");
  EXPECT_NE(refusal(result.refused.front()).find("payload would have to be 1.3"), std::string::npos)
      << refusal(result.refused.front());
}

/// Lifted by `push` of the height over the surface below, along each window: in its mean and in the thrust's moments.
template <typename F>
Observations pushed_by_height(F push) {
  auto seen = quiet();
  const auto column = lifting(seen.windows, [&](const PlaceAround& at) { return push(at.height); });
  for (const auto& [channel, x, aside] : column.parts)
    for (std::size_t i = 0; i < x.size(); ++i) seen.y[channel][i] += x[i];
  return seen;
}

TEST(Plausible, APushThatReachesFartherThanAWashHasNoName) {
  const auto result = studied(pushed_by_height([](double h) { return -0.5 * (h - 1); }));
  ASSERT_FALSE(result.unknown.empty()) << study_worlds::told(result);
  EXPECT_EQ(result.unknown.front().along, "z_m");
  for (const auto& cause : result.causes) {
    EXPECT_NE(cause.found.form->cause(), "ground_thrust") << study_worlds::told(result);
    EXPECT_NE(cause.found.form->cause(), "ceiling") << study_worlds::told(result);
  }
  const auto wash = studied(pushed_by_height([](double h) { return 0.5 * std::exp(-(h - 0.4) / 0.2); }));
  ASSERT_EQ(wash.causes.size(), 1u) << study_worlds::told(wash);
  EXPECT_EQ(wash.causes.front().found.form->cause(), "ground_thrust");
}

TEST(Plausible, ACeilingDoesNotPushDown) {
  EXPECT_FALSE(form_of("ceiling").priors.front().holds(-0.1));
  EXPECT_TRUE(form_of("ceiling").priors.front().holds(0.5));
}

TEST(Plausible, ASizeAtAReferenceThatWasNotFlownIsToldAsExtrapolated) {
  auto seen = quiet();
  const Form& form = form_of("ground_thrust");
  Accepted cause;
  cause.form = &form;
  cause.scale.value = 0.3;
  cause.columns = form.columns(seen.windows, cause.scale);
  cause.theta = SmallVector::Constant(1, 0.12);
  EXPECT_EQ(extrapolated(cause, seen), "");
  for (auto& w : seen.windows) w.around.height += 1;
  EXPECT_NE(extrapolated(cause, seen).find("stated at 0.4 m over the surface, flown 1"), std::string::npos)
      << extrapolated(cause, seen);
}

TEST(Words, OddsAreThoseOfTheNats) {
  EXPECT_EQ(odds(3), "20.1 to 1");
  EXPECT_EQ(odds(521), "more than a million to 1");
  EXPECT_EQ(odds(-1000), "1 to more than a million");
  EXPECT_EQ(odds(-std::log(5.0)), "1 to 5");
}

Vehicle vehicle() {
  Vehicle v;
  v.body.mass = 1;
  v.propulsion.max_thrust = 20;
  v.propulsion.thr_mdl_fac = 0.3;
  v.controller.latency = 0.02;
  v.controller.attitude_lag = 0.05;
  return v;
}

Remedy remedy_for(const std::string& cause, double theta, double scale = 0, std::size_t form = 0) {
  NamedCause named;
  named.found.form = &form_of(cause).effect->forms[form];
  named.found.scale.value = scale;
  named.found.theta = SmallVector::Constant(1, theta);
  return remedy_of(named, vehicle());
}

TEST(Words, ADelayIsAKeyOfTheVehicleFileWithItsValue) {
  const auto late = remedy_for("command_latency", 0.06), lagging = remedy_for("actuator_lag", -0.02, 0, 1);
  ASSERT_EQ(late.set.size(), 1u);
  EXPECT_EQ(late.set[0].key, "controller.latency");
  EXPECT_NEAR(late.set[0].to, 0.08, 1e-12);
  EXPECT_EQ(lagging.set[0].key, "controller.attitude_lag");
  EXPECT_NEAR(lagging.set[0].to, 0.03, 1e-12);
  EXPECT_EQ(remedy_for("propeller_damage", 0.06, 2).words, "Replace or re-glue the propeller of rotor 3.");
}

TEST(Words, AThrustCurveWithTheTwoKeysHoversAtTheSameCommandAndIsSteeperThere) {
  const auto set = remedy_for("thrust_slope", 0.12).set;
  ASSERT_EQ(set.size(), 2u);
  Vehicle before = vehicle(), after = before;
  after.propulsion.thr_mdl_fac = set[0].to;
  after.propulsion.max_thrust = set[1].to;
  const auto thrust = [](const Vehicle& v, double u) { return v.propulsion.max_thrust * thrust_share(v, u); };
  double hover = 0.5;
  for (int i = 0; i < 50; ++i) hover *= std::sqrt(before.body.mass * kGravity / thrust(before, hover));
  EXPECT_NEAR(thrust(after, hover), thrust(before, hover), 1e-6);
  const auto slope = [&](const Vehicle& v) { return (thrust(v, hover + 1e-4) - thrust(v, hover - 1e-4)) / 2e-4; };
  EXPECT_NEAR(slope(after) / slope(before), 1.12, 1e-4);
}

TEST(Words, EveryCauseSaysWhatToChange) {
  for (const Form* f : catalogue()) {
    NamedCause named;
    named.found.form = f;
    named.found.theta = SmallVector::Constant(static_cast<Eigen::Index>(f->parameters.size()), 0.1);
    const auto remedy = remedy_of(named, vehicle());
    EXPECT_TRUE(remedy.words.ends_with(".")) << f->formula;
    EXPECT_EQ(remedy.in == RemedyIn::vehicle, !remedy.set.empty()) << f->formula;
  }
}

}  // namespace

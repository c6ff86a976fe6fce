// SPDX-License-Identifier: BSD-3-Clause
// What a study's extension does to the simulation and to flights that it was not fitted to.
#include "tests/study_worlds/simulation.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "core/config/simulation_terms.hpp"
#include "core/study/findings/extend.hpp"
#include "core/study/findings/residuals.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/support/terms_of.hpp"

namespace {

using namespace backwash;
using namespace backwash::study;

const std::filesystem::path& world_folder() {
  static const struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("study-simulation-test-" + std::to_string(::getpid()));
    ~Folder() { std::filesystem::remove_all(path); }
  } made;
  return made.path;
}

StudyOptions quick() {
  StudyOptions options;
  options.minimum_detectable = options.dependence = false;
  return options;
}

/// 12 flights of a world to be studied, and 12 further ones.
struct Halves {
  Observations fitted, further;
};
Halves halves(const std::string& cause, double size, std::uint64_t seed = 4711) {
  const auto world = study_worlds::draw_world({seed, {cause}, size, 24, ""});
  const auto flights = study_worlds::fly_all(world);
  return {study_worlds::observe(world, {flights.begin(), flights.begin() + 12}, world_folder()),
          study_worlds::observe(world, {flights.begin() + 12, flights.end()}, world_folder())};
}

const NamedCause* named(const StudyResult& result, const std::string& cause) {
  for (const auto& c : result.causes)
    if (c.found.form->cause() == cause) return &c;
  return nullptr;
}

double mean_square(const Observations& seen, Channel c) {
  double sum = 0, n = 0;
  for (std::size_t i = 0; i < seen.windows.size(); ++i)
    if (seen.weight[c][i] > 0) {
      sum += seen.y[c][i] * seen.y[c][i];
      n += 1;
    }
  return sum / n;
}

TEST(Simulation, EveryFormSaysWhatItAddsToIt) {
  for (const Form* form : catalogue()) EXPECT_TRUE(form->simulate) << form->formula;
}

TEST(Simulation, ATermThatNoModelFileHoldsIsNamed) {
  const auto latency = std::ranges::find_if(catalogue(), [](auto* form) { return form->cause() == "command_latency"; });
  NamedCause cause{};
  cause.found.form = *latency;
  cause.found.theta = Eigen::VectorXd::Constant(1, 0.2);
  EXPECT_EQ(why_unwritable(cause, {}), std::nullopt);
  cause.found.theta[0] = 0.5;
  EXPECT_EQ(why_unwritable(cause, {}), "setpoint_delay: number 1 of value is 0.5, wanted in [-0.3, 0.3]");
  cause.found.theta[0] = NAN;
  EXPECT_EQ(why_unwritable(cause, {}), "setpoint_delay: number 1 of value is nan, wanted in [-0.3, 0.3]");
}

TEST(Simulation, ComesNearerToFurtherFlightsByWhatTheStudyFound) {
  for (const char* cause : {"payload", "command_latency"}) {
    const auto proof =
        study_worlds::prove({.cause = cause, .seed = 4711, .held_out = 3, .replicas = 2}, world_folder());
    ASSERT_TRUE(proof.simulated) << cause << ": " << proof.told << proof.refused;
    EXPECT_LT(proof.after, proof.before) << cause;
    EXPECT_GT(proof.share, 0.6) << cause << ": " << proof.before << " to " << proof.after;
  }
}

TEST(Extension, OfASaggingBatteryHoldsOnFlightsWithOtherVoltages) {
  auto [fitted, further] = halves("battery_sag", 1.5);
  const auto result = study::study(fitted, quick());
  const auto* cause = named(result, "battery_sag");
  ASSERT_NE(cause, nullptr) << study_worlds::told(result);
  ASSERT_EQ(cause->found.scale.anchor.size(), 2u);
  ASSERT_EQ(cause->applied.beside.size(), 1u);
  EXPECT_EQ(cause->applied.refused, "");
  EXPECT_GE(cause->applied.coverage_after, cause->applied.coverage_before);
  // Half of the flights alone: their highest and mean voltage are others.
  Observations emptier = further;
  double highest = 0;
  for (const auto& w : further.windows) highest = std::max(highest, w.voltage);
  for (std::size_t i = 0; i < further.windows.size(); ++i)
    if (further.windows[i].voltage > highest - 0.8)
      for (auto& weight : emptier.weight) weight[i] = 0;
  const double before = mean_square(emptier, kMeanZ);
  ASSERT_TRUE(study::apply(terms_of(result), emptier).left.empty());
  EXPECT_LT(mean_square(emptier, kMeanZ), 0.5 * before);
}

TEST(Extension, ThatMakesOtherFlightsLessLikelyIsRefused) {
  auto seen = halves("payload", 1e-3).fitted;
  const Form* form = nullptr;
  for (const Form* f : catalogue())
    if (f->cause() == "ground_thrust") form = f;
  const auto columns = form->columns(seen.windows, {0.3});
  // Every second flight is lifted and the others are pulled: no flight is told by the others.
  for (std::size_t i = 0; i < seen.windows.size(); ++i)
    seen.y[kMeanZ][i] += (seen.windows[i].flight % 2 ? 0.4 : -0.4) * columns[0].parts[0].x[i];
  Evidence evidence(seen);
  evidence.whiten(columns);
  SmallVector theta(1);
  theta << 0.05;
  Accepted found;
  found.form = form;
  found.scale.value = 0.3;
  found.columns = columns;
  found.theta = theta;
  found.p = 0.01;
  found.gain = 5;
  const auto applied = judge(evidence, {found}, {""});
  EXPECT_LT(applied[0].nats, 0);
  EXPECT_NE(applied[0].refused, "");
  StudyResult result;
  NamedCause cause;
  cause.found = found;
  cause.found.parameters = {{"A_mps2", 0.05, 0, 0.1}};
  cause.applied = applied[0];
  result.causes.push_back(cause);
  EXPECT_TRUE(terms_of(result).empty());
  EXPECT_TRUE(simulation_of(result, seen).empty());
  EXPECT_TRUE(extended(Model{}, result, seen).extension.empty());
}

/// Level and up, the shift of a steady push of these flights as a loop leaves it that holds it off at `rate`, 1/s.
void let_decay(Observations& seen, const Accepted& cause, double rate) {
  const auto push = pushes(std::array{cause}, std::array{std::vector<double>()}, seen);
  for (std::size_t i = 0; i < seen.windows.size(); ++i)
    if (auto& w = seen.windows[i]; w.led)
      w.led->off_W -= (1 - std::exp(-rate * w.t)) * push[i].cwiseProduct(w.led->give);
}

TEST(SteadyAnswer, IsKeptWithoutAnIntegratorAndDecaysAtTheRateOfOne) {
  for (const auto& [cause_name, axes] : {std::pair("payload", 1u), std::pair("draft", 0u)}) {
    auto seen = halves(cause_name, 3).fitted;
    auto result = study::study(seen, quick());
    const auto* cause = named(result, cause_name);
    ASSERT_NE(cause, nullptr) << study_worlds::told(result);
    EXPECT_TRUE(result.steady.axes[axes].matters() && result.steady.axes[axes].told());
    EXPECT_TRUE(cause->keeps && cause->positions.empty()) << cause->positions;
    EXPECT_NEAR(result.steady.axes[axes].left, 1, 0.3);
    const auto believed = effects_of(*cause, seen);
    ASSERT_EQ(believed.size(), 1u);
    EXPECT_GT(believed[0].value.norm(), 0.05);

    for (const double rate : {0.03, 0.05}) {
      auto held = seen;
      let_decay(held, cause->found, rate);
      const auto again = study::study(held, quick());
      const auto* same = named(again, cause_name);
      ASSERT_NE(same, nullptr);
      EXPECT_GT(same->shift_decay[axes], 0.5 * rate) << cause_name;
      EXPECT_LT(same->shift_decay[axes], 2 * rate) << cause_name;
      EXPECT_FALSE(same->keeps);
      const auto doubted = effects_of(*same, held);
      EXPECT_EQ(doubted[0].value.norm(), 0);
      EXPECT_TRUE(doubted[0].error.isApprox(believed[0].error + believed[0].value.cwiseAbs(), 1e-6));
      const auto terms = simulation_of(*same, held);
      EXPECT_EQ(std::ranges::count_if(terms, [](auto& t) { return t.is(SimulationTerm::Kind::shift_decay); }), 1);
    }
  }
}

TEST(SteadyAnswer, OfScatteredHoversIsRefusedForPositionsByName) {
  auto seen = halves("payload", 3).fitted;
  for (auto& w : seen.windows)  // each flight stands off by as much as the shift, up or down
    if (w.led) w.led->off_W.z() += w.flight % 2 ? 0.2 : -0.2;
  const auto result = study::study(seen, quick());
  const auto* cause = named(result, "payload");
  ASSERT_NE(cause, nullptr) << study_worlds::told(result);
  EXPECT_FALSE(result.steady.axes[1].told());
  EXPECT_NE(cause->positions.find("cannot be told"), std::string::npos);
  EXPECT_FALSE(cause->keeps);
}

/// What is printed is what is claimed: held-out errors shrink in the channels that gain.
TEST(HeldOut, TheGainIsTheClaimAndItsErrorsShrinkWithIt) {
  for (const char* name : {"payload", "rotor_drag", "recirculation"}) {
    const auto result = study::study(halves(name, 2).fitted, quick());
    const auto* cause = named(result, name);
    ASSERT_NE(cause, nullptr) << study_worlds::told(result);
    const Gain& gain = cause->gain;
    EXPECT_EQ(gain.held_out_nats, cause->found.gain);
    double nats = 0;
    for (const LeftOut& flight : cause->found.flights) nats += flight.nats;
    EXPECT_NEAR(nats, gain.held_out_nats, 1e-9 * nats);
    ASSERT_FALSE(gain.channels.empty());
    EXPECT_LT(gain.rmse_after, gain.rmse_before) << name;
    for (const auto& c : gain.channels) EXPECT_GT(c.windows, 0u) << name;
  }
}

TEST(Residuals, AreOfTheSameWindowsAndLeaveOutWhatWasNotSimulated) {
  Observations measured, replica;
  measured.flights = replica.flights = 2;
  const auto add = [](Observations& seen, std::size_t flight, double t, double y) {
    WindowRow row{};
    row.flight = flight;
    row.t = t;
    seen.windows.push_back(row);
    for (std::size_t c = 0; c < kChannels; ++c) {
      seen.y[c].push_back(y);
      seen.weight[c].push_back(1);
    }
  };
  add(measured, 0, 1, 5);
  add(measured, 0, 3, 6);
  add(measured, 1, 1, 7);
  add(measured, 1, 9, 8);
  add(replica, 0, 1.1, 4);
  add(replica, 0, 2.95, 2);
  add(replica, 1, 1, 4);
  add(replica, 1, 8.7, 0);
  Observations other = replica;
  for (double& y : other.y[kMeanX]) y += 2;
  const Told told = told_of(measured, std::vector{replica, other});
  EXPECT_EQ(told[kMeanX][0], 5);
  EXPECT_EQ(told[kMeanX][1], 3);
  EXPECT_EQ(told[kMeanX][2], 5);
  EXPECT_FALSE(told[kMeanX][3]);  // none within 0.15 s
  const auto error = channel_error(measured, told, kMeanX);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->windows, 3u);
  EXPECT_NEAR(error->value, std::sqrt((0.0 + 9 + 4) / 3), 1e-12);
  EXPECT_NEAR(channel_error(measured, told, kMeanX, true)->value, std::sqrt(13.0 / 3 - 25.0 / 9), 1e-12);
  EXPECT_FALSE(channel_error(measured, told_of(measured, {}), kMeanX)) << "nothing was simulated";
}

}  // namespace

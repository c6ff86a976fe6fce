// SPDX-License-Identifier: BSD-3-Clause
// Estimates of the study on made windows: the truth is sampled or integrated here, not by the forms of the catalogue.
#include "core/study/inference/estimate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/config/config.hpp"
#include "core/study/effects/columns.hpp"

namespace {

using namespace backwash::study;
using backwash::kNoSurface;
using backwash::Vec3;

constexpr std::size_t kSeenFlights = 12, kOfFlight = 24;

bool covers(const Estimate& e, double truth) { return e.low <= truth && truth <= e.high; }

/// Flights of which nothing is measured yet.
Observations flights() {
  Observations seen;
  seen.flights = kSeenFlights;
  seen.windows.resize(kSeenFlights * kOfFlight, WindowRow{});
  for (std::size_t i = 0; i < seen.windows.size(); ++i) {
    auto& w = seen.windows[i];
    w.flight = i / kOfFlight;
    w.sigma.setConstant(0.04);
    if (i % kOfFlight == 0) seen.first.push_back(i);
  }
  seen.first.push_back(seen.windows.size());
  seen.units.first = seen.first;
  for (auto& y : seen.y) y.assign(seen.windows.size(), 0);
  for (auto& weight : seen.weight) weight.assign(seen.windows.size(), 0);
  seen.missing[Source::attitude] = "not flown";
  return seen;
}

void measure(Observations& seen, Channel channel, std::size_t i, double value) {
  seen.y[channel][i] = value;
  seen.weight[channel][i] = 1;
}

/// `parameter`: of the form, where the cause has several.
Accepted refined(const Observations& seen, const std::string& cause, const Scale& scale,
                 const std::string& parameter = "") {
  const Form* form = *std::ranges::find_if(catalogue(), [&](auto* f) {
    return f->cause() == cause && (parameter.empty() || f->parameters.front() == parameter);
  });
  Evidence evidence(seen);
  Accepted found{form, scale, form->columns(seen.windows, scale), {}, 0, 0, {}, {}};
  evidence.whiten(found.columns);
  refine(evidence, found, {});
  return found;
}

/// A voltage that sagged was fitted to the noise of the thrust's delay, and lost 44 nats to a step of the mass.
TEST(Evidence, TheScatterOfAChannelIsNoneOfANoisierOneOfTheSameCause) {
  constexpr double kScatter = 0.05, kNoisier = 30 * kScatter, kSize = 0.5, kOfDelay = 0.3;  // 24 to 32 in the worlds
  Observations seen = flights();
  DesignColumn column{{{kMeanZ, {}}, {kThrustDelay, {}}}};
  std::mt19937 rng(23);
  std::normal_distribution normal;
  for (std::size_t i = 0; i < seen.windows.size(); ++i) {
    const double x = static_cast<double>(i % kOfFlight) / kOfFlight;
    column.parts[0].x.push_back(x);
    column.parts[1].x.push_back(kOfDelay);
    measure(seen, kMeanZ, i, kSize * x + kScatter * normal(rng));
    measure(seen, kThrustDelay, i, kSize * kOfDelay + kNoisier * normal(rng));
  }
  Evidence evidence(seen);
  evidence.whiten({column});
  EXPECT_NEAR(std::sqrt(evidence.scatter(kMeanZ).within), kScatter, 0.1 * kScatter);
  EXPECT_NEAR(std::sqrt(evidence.scatter(kThrustDelay).within), kNoisier, 0.1 * kNoisier);
}

TEST(AveragedEstimate, OfOneModelIsItsNormalInterval) {
  const Estimate e = averaged("x", {{3, 1.2, 0.5}});
  EXPECT_NEAR(e.value, 1.2, 1e-12);
  EXPECT_NEAR(e.low, 1.2 - 0.97998, 1e-4);
  EXPECT_NEAR(e.high, 1.2 + 0.97998, 1e-4);
}

TEST(AveragedEstimate, LeavesAFortiethOfTheModelsDrawsBeyondEachEnd) {
  const std::vector<Guess> guesses = {{2, 0.1, 0.02}, {1, 0.2, 0.05}, {0.2, 0.5, 0.01}};
  const Estimate e = averaged("x", guesses);
  std::mt19937 rng(3);
  std::discrete_distribution<std::size_t> which{2, 1, 0.2};
  std::normal_distribution normal;
  int below = 0, above = 0;
  double sum = 0;
  constexpr int kDraws = 200000;
  for (int i = 0; i < kDraws; ++i) {
    const Guess& g = guesses[which(rng)];
    const double x = g.value + g.error * normal(rng);
    below += x < e.low;
    above += x > e.high;
    sum += x;
  }
  EXPECT_NEAR(below / double{kDraws}, 0.025, 0.0015);
  EXPECT_NEAR(above / double{kDraws}, 0.025, 0.0015);
  EXPECT_NEAR(sum / kDraws, e.value, 0.002);
}

/// Where a hover that is told to hold `height` ends and how it is pushed there: ë = −k_p e − k_d ė + push(height + e),
/// integrated until it rests.
std::pair<double, double> at_rest(double height, double kp, const std::function<double(double)>& push) {
  double e = 0, v = 0;
  for (int i = 0; i < 8000; ++i) {
    v += 1e-3 * (-kp * e - 4 * v + push(height + e));
    e += 1e-3 * v;
  }
  return {height + e, push(height + e)};
}

/// Hovers over a floor that pushes by size (0.4 m/h)².
Observations over_a_floor(double size, double kp, unsigned seed) {
  auto seen = flights();
  std::mt19937 rng(seed);
  std::normal_distribution noise(0.0, 0.03);
  std::uniform_real_distribution told(0.35, 1.4);
  for (std::size_t i = 0; i < seen.windows.size(); ++i) {
    const double height = told(rng);
    const auto [at, push] = at_rest(height, kp, [size](double h) { return size * 0.16 / (h * h); });
    seen.windows[i].around.height = height;
    seen.windows[i].led.emplace().give = Vec3::Constant(1 / kp);
    measure(seen, kMeanZ, i, push + noise(rng));
  }
  return seen;
}

TEST(Refine, FindsAPushWhereTheCraftWasPushedToAndNotWhereItWasTold) {
  for (const double size : {-0.12, 0.12}) {
    constexpr int kWorlds = 5;
    double aware = 0, unaware = 0;
    int covered = 0;
    for (unsigned seed = 1; seed <= kWorlds; ++seed) {
      auto seen = over_a_floor(size, 4, seed);
      const Estimate e = refined(seen, "ground_thrust", {0.3}).parameters[0];
      aware += e.value / kWorlds;
      covered += covers(e, size);
      for (auto& w : seen.windows) w.led.reset();
      unaware += refined(seen, "ground_thrust", {0.3}).parameters[0].value / kWorlds;
    }
    EXPECT_NEAR(aware, size, 0.04 * std::abs(size));
    EXPECT_GE(covered, kWorlds - 1);
    EXPECT_GT(std::abs(unaware - size), 0.08 * std::abs(size));
  }
}

/// Pushed by 0.1 m/s² at a gap of 0.4 m and hardly far away, hovering at those two gaps or at many between.
Observations under_a_ceiling(bool two_gaps, const std::function<double(double)>& push) {
  auto seen = flights();
  std::mt19937 rng(11);
  std::normal_distribution noise(0.0, 0.01);
  std::uniform_real_distribution any(0.22, 1.9);
  for (std::size_t i = 0; i < seen.windows.size(); ++i) {
    const double gap = two_gaps ? (i % 2 ? 0.4 : 1.9) : any(rng);
    seen.windows[i].around.ceiling_gap = gap;
    measure(seen, kMeanZ, i, push(gap) + noise(rng));
  }
  return seen;
}

TEST(Refine, WidensTheIntervalWhereTheFlownGapsCannotTellTheForm) {
  const auto steep = [](double d) { return 0.1 * std::exp((0.4 - d) / 0.15); };
  const auto flat = [](double d) { return 0.1 * 0.4 / d; };
  for (const auto& push : {std::function<double(double)>(steep), std::function<double(double)>(flat)}) {
    const auto two = refined(under_a_ceiling(true, push), "ceiling", {0.3}).parameters[0];
    const auto many = refined(under_a_ceiling(false, push), "ceiling", {0.3}).parameters[0];
    EXPECT_TRUE(covers(two, steep(0.3)) && covers(two, flat(0.3))) << two.low << " " << two.high;
    EXPECT_NEAR(many.value, push(0.3), 0.1 * push(0.3));
    EXPECT_LT(3 * (many.high - many.low), two.high - two.low);
  }
}

/// Hovers of a craft whose thrust goes with the power `s` of its voltage, as modelled at 16.8 V: it commands what it
/// lacks, and what it commands beside that brings as little.
Observations on_sagging_batteries(double s, unsigned seed) {
  auto seen = flights();
  std::mt19937 rng(seed);
  std::normal_distribution noise(0.0, 0.01);
  std::uniform_real_distribution charged(14.4, 15.4);
  for (std::size_t i = 0; i < seen.windows.size(); ++i) {
    auto& w = seen.windows[i];
    w.voltage = i % kOfFlight == 0 ? charged(rng) : seen.windows[i - 1].voltage - 0.04;
    const double flown = std::pow(w.voltage / 16.8, s);
    w.thrust_acc = backwash::kGravity / flown;
    w.slope_gain = {0, 2};
    measure(seen, kMeanZ, i, backwash::kGravity - w.thrust_acc + noise(rng));
    measure(seen, kThrustSlope, i, (flown - 1) * w.slope_gain[1] + noise(rng));
  }
  return seen;
}

TEST(Refine, TellsASagOfTheThrustThatIsCommandedAndLeavesOpenWhereItIsFull) {
  constexpr int kWorlds = 5;
  double mean = 0;
  for (unsigned seed = 1; seed <= kWorlds; ++seed)
    mean += refined(on_sagging_batteries(0.4, seed), "battery_sag", {}).parameters[0].value / kWorlds;
  EXPECT_NEAR(mean, 0.4, 0.02 * 0.4);
}

TEST(Refine, OfALoadLeavesTheVarianceOfTheAirAlone) {
  // A quarter of the thrust is missing: of what set-points ask for, a sine of amplitude a, a third of it is seen.
  std::mt19937 rng(31);
  std::normal_distribution noise(0.0, 0.01);
  auto seen = flights();
  double most = 0;
  for (std::size_t i = 0; i < seen.windows.size(); ++i) {
    auto& w = seen.windows[i];
    const double a = i % 3 ? 0.0 : 1.5;
    w.thrust_acc = backwash::kGravity / 0.75;
    w.led.emplace().asked2.setConstant(a * a / 2);
    measure(seen, kMeanZ, i, -0.25 * w.thrust_acc + noise(rng));
    for (const Channel c : kVariances)
      measure(seen, c, i, std::log((w.sigma[0] + std::pow(a / 3, 2) / 2) / w.sigma[0]) + noise(rng));
    most = std::max(most, seen.y[kVarX][i]);
  }
  const Accepted load = refined(seen, "payload", {}, "m");
  EXPECT_NEAR(load.parameters[0].value, 0.25, 0.005);
  EXPECT_GT(most, 1);
  auto left = seen.y[kVarX];
  for (const auto& part : load.columns[0].parts)
    for (std::size_t i = 0; i < left.size() && part.channel == kVarX; ++i) left[i] -= load.theta[0] * part.x[i];
  for (const double ln : left) ASSERT_NEAR(ln, 0, 0.06);
}

/// ln of the variance, mean and trend taken out, of 2 s of gusts of correlation time 0.15 s and variance e^{B v}.
double ln_variance_of_gusts(double B, const std::function<double(double)>& v, std::mt19937& rng) {
  constexpr int kRows = 200;
  const double decay = std::exp(-2.0 / kRows / 0.15);
  std::normal_distribution normal;
  double gust = normal(rng), sum = 0, moved = 0, square = 0, steps = 0;
  for (int i = 0; i < kRows; ++i) {
    gust = decay * gust + std::sqrt(1 - decay * decay) * normal(rng);
    const double u = (i + 0.5) / kRows - 0.5, x = std::exp(0.5 * B * v(u + 0.5)) * gust;
    sum += x;
    moved += u * x;
    square += x * x;
    steps += u * u;
  }
  return std::log((square - sum * sum / kRows - moved * moved / steps) / kRows);
}

TEST(Refine, FindsHowGustsGoWithTheSpeedInWindowsThatStart) {
  for (const double B : {-1.0, 1.0}) {
    constexpr int kWorlds = 20;
    double mean = 0;
    std::mt19937 rng(23);
    std::uniform_real_distribution pace(0.0, 1.6);
    for (int world = 0; world < kWorlds; ++world) {
      auto seen = flights();
      for (std::size_t i = 0; i < seen.windows.size(); ++i) {
        auto& w = seen.windows[i];
        w.duration = 2;
        w.shares.fill(1.0 / kPoints);
        const double most = pace(rng);
        const auto v = [&](double s) { return i % 4 ? most * s : most; };
        for (std::size_t k = 0; k < kPoints; ++k) w.speeds[k] = v((static_cast<double>(k) + 0.5) / kPoints);
        for (const Channel c : kVariances) measure(seen, c, i, ln_variance_of_gusts(B, v, rng));
      }
      mean += refined(seen, "forward_speed", {1}, "B_ln").parameters[0].value / kWorlds;
    }
    EXPECT_NEAR(mean, B, 0.05);
  }
}

TEST(Refine, FindsADragThatGrowsWithTheSpeedInWindowsThatStart) {
  constexpr int kWorlds = 10;
  std::mt19937 rng(29);
  std::normal_distribution noise(0.0, 0.02);
  std::uniform_real_distribution pace(0.5, 4.0);
  int covered = 0;
  for (int world = 0; world < kWorlds; ++world) {
    auto seen = flights();
    for (std::size_t i = 0; i < seen.windows.size(); ++i) {
      auto& w = seen.windows[i];
      const double most = pace(rng),
                   push = 0.2 * (i % 2 ? most / 2 + 0.15 * most * most / 3 : most * (1 + 0.15 * most));
      for (std::size_t k = 0; k < kPoints; ++k)
        w.speeds[k] = i % 2 ? most * (static_cast<double>(k) + 0.5) / kPoints : most;
      w.v_W = Vec3(i % 2 ? most / 2 : most, 0, 0);
      measure(seen, kMeanX, i, -push + noise(rng));
      measure(seen, kMeanY, i, noise(rng));
    }
    covered += covers(refined(seen, "rotor_drag", {}).parameters[0], 0.23);
  }
  EXPECT_GE(covered, kWorlds - 2);
}

/// ln Σ of a made room, axes alike: stronger towards x = 0 and along a ridge.
double ln_sigma(double x, double y) { return 2 * std::exp(-x / 0.6) + 1.5 * std::exp(-std::pow((y - 1.5) / 0.7, 2)); }

TEST(Refine, FindsAMapOffsetBetweenTheOnesTriedAndCoversBothOfItsCoordinates) {
  constexpr double kX = 0.21, kY = -0.08;
  constexpr int kWorlds = 40;
  int covered = 0;
  double error = 0;
  std::mt19937 rng(17);
  std::normal_distribution noise(0.0, 0.4);
  std::uniform_real_distribution place(0.5, 3.0);
  for (int world = 0; world < kWorlds; ++world) {
    auto seen = flights();
    for (std::size_t i = 0; i < seen.windows.size(); ++i) {
      const double x = place(rng), y = place(rng);
      for (std::size_t n = 0; n < seen.windows[i].ln_sigma_moved.size(); ++n) {
        const double dx = kOffsetStep * (static_cast<double>(n / kOffsetsAside) - (kOffsetsAside - 1) / 2.0),
                     dy = kOffsetStep * (static_cast<double>(n % kOffsetsAside) - (kOffsetsAside - 1) / 2.0);
        seen.windows[i].ln_sigma_moved[n].setConstant(ln_sigma(x + dx, y + dy) - ln_sigma(x, y));
      }
      for (const Channel c : kVariances) measure(seen, c, i, ln_sigma(x + kX, y + kY) - ln_sigma(x, y) + noise(rng));
    }
    const auto found = refined(seen, "map_offset", {0, {0.15, 0, 0}});
    ASSERT_EQ(found.parameters.size(), 2u);
    covered += covers(found.parameters[0], kX) + covers(found.parameters[1], kY);
    error += std::hypot(found.parameters[0].value - kX, found.parameters[1].value - kY) / kWorlds;
    EXPECT_LT((found.scale.offset_W - Vec3(found.parameters[0].value, found.parameters[1].value, 0)).norm(), 1e-3);
  }
  EXPECT_LT(error, 0.05);
  EXPECT_GE(covered, 0.87 * 2 * kWorlds);
}

}  // namespace

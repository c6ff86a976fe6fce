// SPDX-License-Identifier: BSD-3-Clause
// What the study measures on made signals whose truth is known, and on worlds of the independent generator.
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <string>

#include "core/study/inference/evidence.hpp"
#include "core/study/windows/gates/gates.hpp"
#include "core/study/windows/observation.hpp"
#include "core/study/windows/signals/gust_spectrum.hpp"
#include "core/study/windows/signals/instrument.hpp"
#include "core/study/windows/signals/rotor_channels.hpp"
#include "core/study/windows/signals/signals.hpp"
#include "core/study/windows/signals/texture.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/study_worlds/score.hpp"

namespace {

using namespace backwash::study;

constexpr double kRate = 50, kGusts = 0.04, kCorrelation = 0.17;  // Hz, (m/s²)², s

/// Windows of 2 s of Gaussian gusts with an exponential correlation; with bursts of 0.1 s three times as strong, one in
/// five tenths of a second (drawn anew each); white noise of the given deviation on top.
std::vector<Residual> made(std::size_t windows, bool bursts, double noise, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution draw;
  const double phi = std::exp(-1 / (kRate * kCorrelation));
  std::vector<Residual> all;
  for (std::size_t w = 0; w < windows; ++w) {
    Residual r{{}, backwash::Vec3::Constant(kGusts)};
    for (auto& x : r.x) {
      double gust = draw(rng), factor = 1;
      for (int i = 0; i < 100; ++i) {
        if (i % 5 == 0) factor = bursts && rng() % 5 == 0 ? 3 : 1;
        gust = phi * gust + std::sqrt(1 - phi * phi) * draw(rng);
        x.push_back(std::sqrt(kGusts) * factor * gust + noise * draw(rng));
      }
    }
    all.push_back(std::move(r));
  }
  return all;
}

/// 2 s of gusts and noise at 50 Hz with the line of a rotor whose rate wanders about `hz`, and its phase as rpm
/// readings give it that are held for `held` samples and have 0.4 % of noise.
std::optional<RotorLine> made_line(double hz, double amplitude, int held, std::mt19937_64& rng) {
  std::normal_distribution draw;
  const double phi = std::exp(-1 / (kRate * kCorrelation)), dt = 1 / kRate;
  std::vector<double> x, t, phase;
  double gust = draw(rng), wander = 0, truth = 2 * M_PI * std::uniform_real_distribution(0.0, 1.0)(rng), told = 0,
         rate = hz;
  for (int i = 0; i < 100; ++i) {
    gust = phi * gust + std::sqrt(1 - phi * phi) * draw(rng);
    wander = 0.9 * wander + 0.2 * draw(rng);
    if (i % held == 0) rate = (hz + wander) * (1 + 0.004 * draw(rng));
    truth += 2 * M_PI * (hz + wander) * dt;
    told += 2 * M_PI * rate * dt;
    x.push_back(std::sqrt(kGusts) * gust + 0.05 * draw(rng) + amplitude * std::sin(truth));
    t.push_back(i * dt);
    phase.push_back(told);
  }
  return rotor_line(detrended(x), t, phase);
}

double mean_excess(double hz, double amplitude, int held) {
  std::mt19937_64 rng(17);
  double sum = 0;
  for (int k = 0; k < 400; ++k) sum += made_line(hz, amplitude, held, rng).value().excess / 400;
  return sum;
}

TEST(RotorLine, IsToldWhereSamplingFoldsItBelowSixHertz) {
  for (const double folded : {1.5, 3.0, 5.0})
    for (const int held : {1, 5}) {
      const double floor = 0.25;  // ln power: less is not called a vibration
      EXPECT_GT(mean_excess(150 + folded, 0.5, held), 3 * floor) << folded << " Hz, held for " << held;
      EXPECT_LT(std::abs(mean_excess(150 + folded, 0, held)), 0.7 * floor) << folded << " Hz, held for " << held;
    }
}

TEST(RotorLine, IsNotToldWhereItIsAsSlowAsAGust) {
  std::mt19937_64 rng(18);
  EXPECT_FALSE(made_line(150.1, 0.5, 1, rng));
}

TEST(RotorLine, AmplitudeIsThatOfTheLineHoweverItIsFolded) {
  std::mt19937_64 rng(19);
  for (const double hz : {153.0, 165.0}) {
    double power = 0;
    for (int k = 0; k < 400; ++k) power += made_line(hz, 0.5, 1, rng).value().amplitude2 / 400;
    EXPECT_NEAR(std::sqrt(power), 0.45, 0.07) << hz;  // a tenth is lost to the phase's drift
  }
}

double tail_of(const std::vector<Residual>& windows) {
  const Texture texture = texture_of(windows, kRate);
  std::vector<Fourth> fourth;
  for (const auto& w : windows) fourth.push_back(fourth_moments(w, texture));
  double mean = 0;
  for (const double y : tails(fourth)) mean += y / static_cast<double>(windows.size());
  return mean;
}

// A climb leads through air of which Σ is ten times as large below as above: no burst.
TEST(Tails, OfAirThatChangesAlongAWindowAreThoseOfItsModelledCourse) {
  auto windows = made(600, false, 0, 23);
  double squares = 0;
  std::vector<double> course;
  for (int i = 0; i < 100; ++i) course.push_back(std::pow(10, i / 99.0));
  for (const double x : course) squares += x / 100;
  for (auto& w : windows) {
    for (auto& x : w.x)
      for (std::size_t i = 0; i < x.size(); ++i) x[i] *= std::sqrt(course[i] / squares);
  }
  EXPECT_GT(tail_of(windows), 0.15);  // what is called bursts, of windows whose Σ is one number
  for (auto& w : windows)
    for (const double x : course) w.share.push_back(x / squares);
  EXPECT_LT(std::abs(tail_of(windows)), 0.05);
}

// Rotors of one rate have one line: each window's is the value of one of them, in turn. 2 Hz apart each has its own.
TEST(RotorValues, OneLineOfSeveralRotorsCountsOnce) {
  for (const double apart : {0.0, 2.0}) {
    std::mt19937_64 rng(7);
    std::normal_distribution draw;
    backwash::log::FlightLog log;
    Series s;
    std::vector<double> residual;
    for (std::size_t i = 0; i < 100; ++i) {
      s.t.push_back(static_cast<double>(i) / kRate);
      s.row.push_back(i);
      residual.push_back(draw(rng));
      for (std::size_t r = 0; r < 4; ++r)
        log.columns["rpm" + std::to_string(r + 1)].push_back(60 * (190 + apart * static_cast<double>(r)));
    }
    const auto phases = rotor_phases(log, s);
    for (std::size_t turn = 0; turn < 8; ++turn) {
      std::array<std::optional<RotorLine>, 4> lines;
      std::vector<std::size_t> told;
      for (const auto& value : rotor_values(log, s, phases, backwash::Vehicle{}, residual, 0, 100, turn, lines))
        if (value.channel >= kLine1 && value.channel < kLine1 + 4) told.push_back(value.channel - kLine1);
      EXPECT_EQ(told, apart > 0 ? std::vector<std::size_t>({0, 1, 2, 3}) : std::vector<std::size_t>({turn % 4}));
      for (const auto& line : lines) EXPECT_TRUE(line);
    }
  }
}

TEST(Texture, WhitePartIsTheNoiseOnGustsAndNothingOnSmoothSignals) {
  const Texture noisy = texture_of(made(200, false, 0.06, 1), kRate);
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(noisy.white[axis], 0.0036, 0.0008);
  EXPECT_NEAR(noisy.scale, 1, 0.1);
  auto smooth = made(200, false, 0.06, 2);
  for (auto& w : smooth)
    for (auto& x : w.x) {  // as a filter of eight samples leaves it
      std::vector<double> filtered;
      for (std::size_t i = 7; i < x.size(); ++i)
        filtered.push_back(
            std::accumulate(x.begin() + static_cast<long>(i) - 7, x.begin() + static_cast<long>(i) + 1, 0.0) / 8);
      x = filtered;
    }
  const Texture none = texture_of(smooth, kRate);
  for (int axis = 0; axis < 3; ++axis) EXPECT_LT(none.white[axis], 0.0002);
}

TEST(Tails, AreZeroForGaussianGustsAndTheBurstsKurtosisInShortNoisyWindows) {
  // E m⁴/(E m²)² of a factor that is 3 in one of five tenths of a second, else 1.
  const double truth = std::log((0.2 * 81 + 0.8) / std::pow(0.2 * 9 + 0.8, 2));
  EXPECT_NEAR(tail_of(made(1500, false, 0.05, 3)), 0, 0.05);
  EXPECT_NEAR(tail_of(made(1500, true, 0.05, 4)), truth, 0.08);
}

// A line takes 18 % of the variance of a 2.5 s stretch with it, and a third of one of 1.3 s: passes are shorter than
// hovers.
TEST(Spread, SaysTheVarianceThatWasMadeHoweverShortTheStretch) {
  std::mt19937_64 rng(20261126);
  std::normal_distribution draw;
  for (const double tau : {0.1, 0.15, 0.25})
    for (const std::size_t n : {50U, 64U, 100U, 125U}) {
      const double phi = std::exp(-1 / (kRate * tau));
      double sum = 0;
      constexpr int kStretches = 6000;
      for (int w = 0; w < kStretches; ++w) {
        std::vector<double> x{draw(rng)};
        while (x.size() < n) x.push_back(phi * x.back() + std::sqrt(1 - phi * phi) * draw(rng));
        sum += spread(detrended(x)).variance / kStretches;
      }
      EXPECT_NEAR(sum / left_by_a_line(n, 1 / kRate, tau), 1, 0.03) << n << " rows, " << tau << " s";
      EXPECT_LT(left_by_a_line(n, 1 / kRate, tau), left_by_a_line(2 * n, 1 / kRate, tau));
    }
  EXPECT_NEAR(left_by_a_line(100, 1 / kRate, 1e-6), 1, 1e-3) << "white noise";
}

TEST(SlowCourse, KeepsADischargeAndDropsWhatAlternates) {
  std::vector<double> t, discharge, logged;
  for (int i = 0; i < 40; ++i) {
    t.push_back(2 * i);
    discharge.push_back(16.4 - 0.012 * t.back() + 2e-5 * t.back() * t.back());
    logged.push_back(discharge.back() + (i % 2 ? 0.05 : -0.05));
  }
  const auto course = slow_course(t, logged);
  for (std::size_t i = 0; i < t.size(); ++i) EXPECT_NEAR(course[i], discharge[i], 0.012);
  EXPECT_EQ(slow_course(std::vector{3.0}, std::vector{11.1}), std::vector{11.1});
}

TEST(DelayStage, FindsADelayThatIsNotShortAgainstTheSetPoints) {
  // Set-points along sin ωt, heard τ later: Σ cos ωt (sin ω(t − τ) − sin ωt) = −sin(ωτ) Σ cos².
  const double omega = 15, tau = 0.06;
  DelayStage stage;
  for (std::size_t w = 0; w < 20; ++w) {
    DelayStage::PerSecond design;
    const double strength = 1 + 0.1 * static_cast<double>(w);
    for (std::size_t k = 0; k < kShifts.size(); ++k)
      design[k] = strength * (kShifts[k] == 0 ? omega : std::sin(omega * kShifts[k]) / kShifts[k]);
    stage.add(w, strength * std::sin(omega * tau), design);
  }
  for (const auto& [window, design] : stage.designs())
    EXPECT_NEAR((1 + 0.1 * static_cast<double>(window)) * std::sin(omega * tau) / design, tau, 0.001);
  EXPECT_LT(std::sin(omega * tau) / omega, 0.9 * tau);  // what the tangent would tell
}

/// Estimate of a cause by its first form with all flights of a world.
double estimate(const study_worlds::HiddenWorld& world, const std::string& cause) {
  const auto folder = std::filesystem::temp_directory_path() / ("study-signals-" + std::to_string(::getpid()));
  const auto seen = study_worlds::observe(world, folder);
  std::filesystem::remove_all(folder);
  for (const Form* form : catalogue())
    if (form->cause() == cause)
      return Evidence(seen).normal(form->columns(seen.windows, form->scales.front()), {}).fit()[0];
  throw std::logic_error(cause);
}

TEST(ThrustSlope, IsTheSameShareOfASteeperAndOfAShallowerCurve) {
  // A closed loop commands 1/(1 + s) of the nominal thrust: told from that, +0.25 would be 0.20 and −0.25 be −0.33.
  auto world = study_worlds::draw_world({4711, {"thrust_slope"}, 1, 10, ""});
  for (const double s : {0.25, -0.25}) {
    world.effects.size["thrust_slope"] = s;
    EXPECT_NEAR(estimate(world, "thrust_slope") / s, 1, 0.15) << s;
  }
}

TEST(StudyWorlds, IntervalsHoldTheTailThatWasFlown) {
  const auto folder = std::filesystem::temp_directory_path() / ("study-tail-" + std::to_string(::getpid()));
  const auto o = study_worlds::score({"heavy_tails", {"heavy_tails"}}, 4711, 1, 12, folder);
  std::filesystem::remove_all(folder);
  ASSERT_EQ(o.compared.size(), 1u) << study_worlds::told(o.sets, o.unknown);
  EXPECT_NEAR(o.compared[0].value, o.compared[0].truth, 0.15 * o.compared[0].truth);
}

TEST(Study, TellsASaggingBatteryFromEqualStartsWithoutAFalseNameBesideIt) {
  const auto folder = std::filesystem::temp_directory_path() / ("study-battery-" + std::to_string(::getpid()));
  const study_worlds::MatrixCell cell{"battery_sag, equal batteries", {"battery_sag"}, "battery"};
  const auto o = study_worlds::score(cell, 4711, 1, 12, folder);
  std::filesystem::remove_all(folder);
  EXPECT_TRUE(o.in_sets()) << study_worlds::told(o.sets, o.unknown);
  EXPECT_FALSE(o.wrong_name()) << study_worlds::told(o.sets, o.unknown);
}

TEST(Gaps, AGapIsLongerThanFivePeriodsAndFiftyMilliseconds) {
  std::vector<double> t;
  for (int k = 0; k < 100; ++k) t.push_back(0.01 * k + (k >= 40 ? 0.03 : 0) + (k >= 70 ? 0.06 : 0));  // 0.04 s, 0.07 s
  const auto stretches = unbroken(t);
  ASSERT_EQ(stretches.size(), 2u);
  EXPECT_EQ(stretches[0].end, 70u);
  EXPECT_EQ(stretches[1].end, 100u);
}

}  // namespace

namespace backwash::study {
namespace {

constexpr double kRate = 50, kTau = 0.2;
constexpr std::size_t kRows = 400;

/// Gusts of variance 1 by their textbook recursions in time, not by the spectra that are fitted; noise added.
class Gusts {
 public:
  Gusts(GustShape shape, double noise, std::uint64_t seed) : shape_(shape), noise_(noise), random_(seed) {}

  std::vector<double> stretch() {
    auto x = shape_ == GustShape::karman ? harmonics() : filtered();
    for (double& value : x) value += noise_ * normal_(random_);
    return x;
  }

 private:
  /// White noise through one lag of τ, or through two of τ/2 each, at 32 steps a row.
  std::vector<double> filtered() {
    const bool twice = shape_ == GustShape::second_order;
    constexpr int kSteps = 32;
    const double keep = std::exp(-1 / (kRate * kSteps) / (twice ? kTau / 2 : kTau));
    std::vector<double> out;
    for (std::size_t k = 0; k < kRows + 100; ++k) {
      for (int i = 0; i < kSteps; ++i) {
        one_ = keep * one_ + std::sqrt(1 - keep * keep) * normal_(random_);
        two_ = keep * two_ + (1 - keep) * one_;
      }
      if (k >= 100) out.push_back(twice ? std::numbers::sqrt2 * two_ : one_);
    }
    return out;
  }
  /// von Kármán's spectrum as MIL-F-8785C prints it: (1 + (1.339 ω L/V)²)^(−5/6), L/V = τ.
  std::vector<double> harmonics() {
    std::vector<double> out(kRows);
    constexpr double kStep = 0.02;
    double variance = 0;
    for (double f = kStep / 2; f < 100; f += kStep) {
      const double s = std::pow(1 + std::pow(1.339 * 2 * std::numbers::pi * f * kTau, 2), -5.0 / 6);
      const double a = std::sqrt(s) * normal_(random_), b = std::sqrt(s) * normal_(random_);
      variance += s;
      for (std::size_t k = 0; k < kRows; ++k) {
        const double angle = 2 * std::numbers::pi * f * static_cast<double>(k) / kRate;
        out[k] += a * std::cos(angle) + b * std::sin(angle);
      }
    }
    for (double& x : out) x /= std::sqrt(variance);
    return out;
  }

  GustShape shape_;
  double noise_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double one_ = 0, two_ = 0;
};

/// Median of τ over 40 stretches by the shape that is likeliest over all of them, and that shape.
std::pair<double, GustShape> told(Gusts gusts) {
  std::array<std::vector<double>, kGustShapes> taus;
  std::array<double, kGustShapes> sum{};
  for (int n = 0; n < 40; ++n) {
    const std::vector<std::vector<double>> axes{gusts.stretch(), gusts.stretch(), gusts.stretch()};
    const GustFits fits = gust_fits(axes, kRate, Band{}.within(kRate), [](std::size_t, double) { return 1.0; });
    for (std::size_t k = 0; k < kGustShapes; ++k) {
      taus[k].push_back(fits[k].tau_s);
      sum[k] += fits[k].ln_likelihood;
    }
  }
  const auto best = static_cast<std::size_t>(std::max_element(sum.begin(), sum.end()) - sum.begin());
  std::sort(taus[best].begin(), taus[best].end());
  return {taus[best][20], static_cast<GustShape>(best)};
}

class GustSpectrum : public testing::TestWithParam<std::pair<GustShape, double>> {};

TEST_P(GustSpectrum, TellsShapeAndCorrelationTimeThroughBandAndNoise) {
  const auto [shape, noise] = GetParam();
  const auto [tau, found] = told(Gusts(shape, noise, 1));
  EXPECT_EQ(found, shape);
  EXPECT_NEAR(tau, kTau, 0.1 * kTau);
}

std::string named(const testing::TestParamInfo<std::pair<GustShape, double>>& told) {
  const std::string names[] = {"VonKarman", "FirstOrder", "SecondOrder"};
  return names[static_cast<std::size_t>(told.param.first)] + (told.param.second > 0 ? "InNoise" : "");
}

INSTANTIATE_TEST_SUITE_P(Shapes, GustSpectrum,
                         testing::Values(std::pair{GustShape::karman, 0.0}, std::pair{GustShape::first_order, 0.0},
                                         std::pair{GustShape::second_order, 0.0},
                                         std::pair{GustShape::first_order, 0.2},
                                         std::pair{GustShape::second_order, 0.2}),
                         named);

TEST(GustSpectrum, AVehicleAtRestAndAStretchTooShortCountAsWhite) {
  const std::vector<std::vector<double>> still(3, std::vector<double>(100, 0.3)), brief(3, std::vector<double>(4, 1));
  for (const auto& axes : {still, brief})
    for (const auto& fit : gust_fits(axes, kRate, Band{}.within(kRate), [](std::size_t, double) { return 1.0; }))
      EXPECT_EQ(fit.tau_s, 0.5 / kRate);
}

}  // namespace
}  // namespace backwash::study

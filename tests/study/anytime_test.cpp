// SPDX-License-Identifier: BSD-3-Clause
// Evidence that may be looked at after every flight (docs/model.md section 8).
#include "core/study/inference/anytime.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <random>

#include "core/study/windows/same_gusts.hpp"
#include "tests/study_worlds/observe.hpp"

namespace {

using namespace backwash::study;

SmallMatrix one(double a) { return SmallMatrix::Constant(1, 1, a); }
SmallVector one_vector(double b) { return SmallVector::Constant(1, b); }

// By integration over θ and κ, of one score a flight.
TEST(Anytime, TheBayesFactorIsTheRatioOfTheTwoMarginals) {
  const std::vector<std::pair<double, double>> flights = {{2.0, 1.1}, {0.5, 0.9}, {3.0, 4.0}, {1.0, 0.2}};
  for (const double null : {0.0, 0.4}) {
    FlightScores scores;
    for (const auto& [a, b] : flights) scores.add(one(a), one_vector(b));
    const double prior = 0.1 * 2.0;  // a tenth of the first flight's information
    double with = 0, without = 0;
    for (double ln_kappa = -12; ln_kappa < 18; ln_kappa += 0.02) {
      const double kappa = std::exp(ln_kappa);  // density 1/κ, dκ = κ d ln κ
      const auto likelihood = [&](double theta) {
        double l = 1;
        for (const auto& [a, b] : flights)
          l *= std::exp(-std::pow(b - a * theta, 2) / (2 * a * kappa)) / std::sqrt(kappa);
        return l;
      };
      without += likelihood(null);
      const double sd = std::sqrt(kappa / prior), step = sd / 200;
      for (double theta = null - 8 * sd; theta <= null + 8 * sd; theta += step)
        with += likelihood(theta) * std::exp(-std::pow((theta - null) / sd, 2) / 2) / (sd * std::sqrt(2 * M_PI)) * step;
    }
    const SmallVector off = scores.fit() - one_vector(null);
    EXPECT_NEAR(scores.log_bayes_factor(off), std::log(with / without), 0.01) << null;
  }
}

// 4,000 sequences of 40 flights without an effect, of every scatter: with the scatter taken for known (κ = 1) the
// second would pass 1/α in most of them.
TEST(Anytime, LookedAtAfterEveryFlightItPassesOneOverAlphaInAShareOfAlphaAtMost) {
  std::mt19937_64 rng(5);
  std::normal_distribution draw;
  for (const double kappa : {0.1, 1.0, 30.0}) {
    int alarms = 0;
    for (int n = 0; n < 4000; ++n) {
      FlightScores scores;
      double highest = 0;
      for (int f = 0; f < 40; ++f) {
        const double a = 1 + 0.5 * draw(rng) * draw(rng);
        if (!(a > 0.2)) continue;
        scores.add(one(a), one_vector(std::sqrt(kappa * a) * draw(rng)));
        highest = std::max(highest, scores.log_bayes_factor(scores.fit()));
      }
      alarms += highest >= std::log(20.0) ? 1 : 0;
    }
    EXPECT_LE(alarms, 4000 * 0.05 + 3 * std::sqrt(4000 * 0.05 * 0.95)) << kappa;
    EXPECT_GE(alarms, 20) << kappa << ": it could never alarm";
  }
}

TEST(Anytime, AnEffectOfThreeStandardErrorsAFlightIsFoundWithinFifteen) {
  std::mt19937_64 rng(6);
  std::normal_distribution draw;
  int found = 0;
  for (int n = 0; n < 500; ++n) {
    FlightScores scores;
    for (int f = 0; f < 15; ++f) scores.add(one(4), one_vector(4 * 1.5 + 2 * draw(rng)));
    found += scores.log_bayes_factor(scores.fit()) >= std::log(400.0) ? 1 : 0;
  }
  EXPECT_GE(found, 475);
}

// Brute force over the set of no effects.
TEST(Anytime, TheNearestPlaceWithoutAnEffectIsTheNearest) {
  Form form;
  form.floor = 0.5;
  form.least = 0.3;
  SmallMatrix information(2, 2), size(2, 2);
  information << 4, 1.5, 1.5, 2;
  size << 1, 0.2, 0.2, 0.5;
  for (const auto& [x, y] : {std::pair(1.0, 0.4), {0.31, 2.0}, {-0.9, 0.1}, {0.2, 3.0}, {0.3, 0.1}}) {
    const SmallVector theta = (SmallVector(2) << x, y).finished();
    const SmallVector off = off_no_effect(form, theta, information, size);
    double nearest = INFINITY;
    for (double a = -2; a <= 2; a += 0.005)
      for (double b = -4; b <= 4; b += 0.01) {
        const SmallVector at = (SmallVector(2) << a, b).finished();
        if (std::abs(a) > form.least && at.dot(size * at) > form.floor * form.floor) continue;
        nearest = std::min(nearest, (theta - at).dot(information * (theta - at)));
      }
    EXPECT_NEAR(std::sqrt(off.dot(information * off)), std::sqrt(nearest), 0.02) << x << ' ' << y;
  }
  form.one_sided = true;
  EXPECT_EQ(off_no_effect(form, (SmallVector(2) << -1, 4).finished(), information, size).norm(), 0);
}

// ∫ f = 1 makes it an e-value; f falls in p.
TEST(Anytime, TheCalibratorIntegratesToOne) {
  double area = 0, last = INFINITY;
  for (double x = -40; x < 0; x += 0.001) {  // p = e^x
    const double f = std::exp(log_calibrated(-(x + 0.0005)));
    area += f * std::exp(x + 0.0005) * 0.001;
    EXPECT_LE(f, last * (1 + 1e-9));
    last = f;
  }
  EXPECT_NEAR(area, 1, 0.03);  // the rest lies below e^−40: 1/40
  EXPECT_NEAR(log_calibrated(0), std::log(0.5), 1e-12);
  EXPECT_NEAR(log_calibrated(1e-5), std::log(0.5), 1e-4);
}

struct Seen {
  std::vector<double> log_e;
  std::string leading;
};

/// After every flight, or after the last alone.
Seen look(const std::string& cause, int flights, bool last_alone = false) {
  const auto folder = std::filesystem::temp_directory_path() / ("anytime-test-" + std::to_string(getpid()));
  study_worlds::Request request;
  request.seed = 100;
  request.flights = flights;
  if (!cause.empty()) request.causes = {cause};
  Anytime anytime;
  study_worlds::observe_each(study_worlds::draw_world(request), folder, [&, n = 0](const Observations& seen) mutable {
    if (++n == flights || !last_alone) anytime.look(seen);
  });
  std::filesystem::remove_all(folder);
  return {anytime.log_e(), std::ranges::max_element(anytime.causes(), {}, [](auto& c) { return c.second; })->first};
}

TEST(Anytime, ARealEffectPassesAndAWorldWithoutNeverDoes) {
  const Seen none = look("", 20), drag = look("rotor_drag", 20);
  ASSERT_EQ(none.log_e.size(), 20u);
  EXPECT_LT(*std::ranges::max_element(none.log_e), std::log(20.0));
  EXPECT_EQ(drag.leading, "rotor_drag");
  EXPECT_GT(drag.log_e.back(), std::log(1000.0));
  for (std::size_t n = 1; n < drag.log_e.size(); ++n) EXPECT_GE(drag.log_e[n], drag.log_e[n - 1] - 1e-12) << n;
  for (std::size_t n = 0; n < 4; ++n) EXPECT_NEAR(drag.log_e[n], std::log(0.5), 1e-12) << "bet before the first look";
}

// What a flight is weighed by comes from those before it: later ones change no bet.
TEST(Anytime, LookingLessOftenChangesNoBet) {
  const Seen each = look("rotor_drag", 9), once = look("rotor_drag", 9, true);
  ASSERT_EQ(once.log_e.size(), 1u);
  EXPECT_GT(once.log_e.back(), std::log(20.0));
  EXPECT_NEAR(once.log_e.back(), each.log_e.back(), 1e-6);
}

// Alike flown, in the same room: only the copy has the same gusts.
TEST(SameGusts, AFlightUnderOtherStampsAndWithALittleNoiseIsFoundAndNoOther) {
  study_worlds::Request request;
  request.seed = 7;
  request.flights = 8;
  request.causes = {"recirculation"};
  request.size = 3;
  const auto world = study_worlds::draw_world(request);
  auto flights = study_worlds::fly_all(world);
  for (unsigned replica = 1; replica <= 2; ++replica) flights.push_back(study_worlds::fly_again(world, 2, replica));
  flights.push_back(flights[5]);
  std::mt19937_64 rng(8);
  std::normal_distribution draw;
  auto& copy = flights.back();
  for (std::size_t c = 0; c < copy.names.size(); ++c)
    for (auto& row : copy.rows) {
      if (copy.names[c] == "t_s") row[c] += 500;
      if (copy.names[c] == "x_m" || copy.names[c] == "y_m" || copy.names[c] == "z_m") row[c] += 5e-4 * draw(rng);
      if (copy.names[c].starts_with("a")) row[c] += 0.02 * draw(rng);
    }
  const auto folder = std::filesystem::temp_directory_path() / ("same-gusts-" + std::to_string(getpid()));
  const auto same = same_gusts(study_worlds::observe(world, flights, folder));
  std::filesystem::remove_all(folder);
  ASSERT_EQ(same.size(), 11u);
  for (std::size_t f = 0; f < 10; ++f) EXPECT_EQ(same[f], f) << "flown again along the same way: 8 and 9";
  EXPECT_EQ(same[10], 5u);
}

}  // namespace

// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <unistd.h>

#include <cmath>
#include <numbers>
#include <random>
#include <tuple>

#include "core/config/config.hpp"
#include "core/study/inference/intervals.hpp"
#include "core/study/windows/observer.hpp"
#include "core/study/windows/signals/distributions.hpp"
#include "core/study/windows/signals/same_gusts.hpp"
#include "tests/study_worlds/observe.hpp"

namespace backwash::study {
namespace {

/// Mass of Student's t between −x and x: Simpson's rule over the density.
double student_mass(double x, double n) {
  constexpr int kSteps = 20000;
  const double scale = std::exp(std::lgamma((n + 1) / 2) - std::lgamma(n / 2)) / std::sqrt(n * std::numbers::pi);
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double at = -x + 2 * x * i / kSteps, weight = i == 0 || i == kSteps ? 1 : i % 2 ? 4 : 2;
    sum += weight * std::pow(1 + at * at / n, -(n + 1) / 2);
  }
  return scale * sum * 2 * x / (3 * kSteps);
}

TEST(Distributions, StudentsQuantileHoldsItsShareOfTheDensity) {
  for (const double n : {1.0, 3.0, 5.0, 11.0, 40.0}) {
    EXPECT_NEAR(student_mass(student_975(n), n), 0.95, 1e-6) << n;
    EXPECT_NEAR(student_mass(student_quantile(1 - 0.05 / 4, n), n), 0.975, 1e-6) << n;
  }
}

TEST(Distributions, DigammaAndTrigammaAreTheDerivativesOfTheLogarithmOfGamma) {
  EXPECT_NEAR(digamma(1), -std::numbers::egamma, 1e-14);
  EXPECT_NEAR(trigamma(1), std::numbers::pi * std::numbers::pi / 6, 1e-14);
  for (const double x : {0.5, 2.7, 9.0, 120.0}) {
    EXPECT_NEAR(digamma(x + 1), digamma(x) + 1 / x, 1e-12) << x;
    EXPECT_NEAR(trigamma(x + 1), trigamma(x) - 1 / (x * x), 1e-12) << x;
    EXPECT_NEAR(digamma(x), (std::lgamma(x + 1e-4) - std::lgamma(x - 1e-4)) / 2e-4, 1e-6) << x;
  }
}

Observed looked_at() {
  const auto vehicle = config::load_vehicle("builtin:quad-5in").value();
  log::FlightLog log;
  for (int k = 0; k < 600; ++k) {
    const double t = 0.02 * k;
    log.t_s.push_back(t);
    log.columns["segment"].push_back(0);
    // Swings along each axis: amplitude in m, 1/s.
    for (const auto& [axis, size, w] : {std::tuple('x', 0.05, 1.0), {'y', 0.04, 1.3}, {'z', 0.05, 0.9}}) {
      log.columns[std::string{axis, '_', 'm'}].push_back(1.5 + size * std::sin(w * t));
      log.columns[std::string{'v', axis, '_', 'm', 'p', 's'}].push_back(size * w * std::cos(w * t));
      log.columns[std::string{'a', axis, '_', 'm', 'p', 's', '2'}].push_back(-size * w * w * std::sin(w * t) +
                                                                             0.1 * std::sin(9 * t));
    }
  }
  MapView open(nullptr, Model{});
  Observer observer(vehicle, open);
  observer.add(log);
  return observer.take();
}

TEST(Observed, ComesBackFromItsBytesAndFromNoOthers) {
  const auto flight = looked_at();
  ASSERT_GT(flight.seen.windows.size(), 2u);
  const std::string bytes = packed(flight);
  const auto again = unpacked(bytes);
  ASSERT_TRUE(again);
  EXPECT_EQ(packed(*again), bytes);
  EXPECT_EQ(again->seen.windows[1].p_W, flight.seen.windows[1].p_W);
  EXPECT_EQ(again->seen.y, flight.seen.y);
  EXPECT_EQ(again->ever, flight.ever);
  for (std::size_t n = 0; n < bytes.size(); n += 1 + n / 60) EXPECT_FALSE(unpacked(bytes.substr(0, n))) << n;
  EXPECT_FALSE(unpacked(bytes + "x"));
}

/// Whatever the bytes are, nothing beyond them is read and no memory beyond them is asked for.
TEST(Observed, DamagedBytesAreRefusedOrAreAFlightThatIsSound) {
  const std::string bytes = packed(looked_at());
  for (std::size_t n = 0; n < bytes.size(); n += n < 4000 ? 1 : 97) {
    auto damaged = bytes;
    damaged[n] = static_cast<char>(~damaged[n]);
    const auto flight = unpacked(damaged);
    if (!flight) continue;
    ASSERT_EQ(flight->seen.first.back(), flight->seen.windows.size());
    for (const auto& row : flight->seen.windows) ASSERT_LT(row.flight, flight->seen.flights);
    for (const auto& w : flight->delays.thrust) ASSERT_LT(w.window, flight->seen.windows.size());
  }
}

}  // namespace
}  // namespace backwash::study

namespace {

using namespace backwash::study;

// Alike flown, in the same room: only the copy has the same gusts.
TEST(SameGusts, AFlightUnderOtherStampsAndWithALittleNoiseIsFoundAndNoOther) {
  study_worlds::Request request;
  request.seed = 7, request.flights = 8, request.causes = {"recirculation"}, request.size = 3;
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
  const auto seen = study_worlds::observe(world, flights, folder);
  std::vector<Gusts> gusts;
  for (std::size_t f = 0; f < seen.flights; ++f) gusts.push_back(gusts_of(seen, f));
  const auto same = same_gusts(std::move(gusts));
  std::filesystem::remove_all(folder);
  ASSERT_EQ(same.size(), 11u);
  for (std::size_t f = 0; f < 10; ++f) EXPECT_EQ(same[f], f) << "flown again along the same way: 8 and 9";
  EXPECT_EQ(same[10], 5u);
}

}  // namespace

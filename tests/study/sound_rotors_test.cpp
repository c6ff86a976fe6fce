// SPDX-License-Identifier: BSD-3-Clause
// Rotors that differ as craft are built, heavy weights and damaged propellers (rates: study_shares --weights).
#include "core/study/inference/rotors/sound_rotors.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace backwash::study {
namespace {

/// ln of four thrusts over their mean logarithm, rotors 1–3 and 2–4 facing each other.
std::array<double, 4> shares(std::array<double, 4> thrust) {
  double mean = 0;
  for (double& t : thrust) {
    t = std::log(t);
    mean += t / 4;
  }
  for (double& t : thrust) t -= mean;
  return thrust;
}

TEST(YawBalance, ANearWeightDoesNotTwistHoweverHeavyAndADamagedPropellerDoes) {
  for (const double mass : {0.05, 0.15, 0.3}) {
    const auto b = yaw_balance(shares({1 + 3 * mass, 1 + mass, 1 - mass, 1 + mass}), 0.01);
    EXPECT_NEAR(b.yaw, 0, 1e-12) << mass;
    EXPECT_TRUE(b.weight() && !b.propeller()) << mass;
  }
  for (const double d : {0.15, 0.4}) {
    const auto b = yaw_balance(shares({1, 1, 1 + d, 1}), 0.01);
    EXPECT_NEAR(b.yaw, d / (4 + d), 1e-12) << d;
    EXPECT_TRUE(b.propeller() && !b.weight()) << d;
  }
}

TEST(YawBalance, OfACraftWhoseRotorsAreNotKnownTellsNeither) {
  const auto weight = yaw_balance(shares({1.3, 1.1, 0.9, 1.1}), 0.1), damage = yaw_balance(shares({1.3, 1, 1, 1}), 0.1);
  for (const auto& b : {weight, damage}) EXPECT_TRUE(b.weight() && b.propeller());
}

/// Motor commands of flights: rotors as built, flights scattered by 0.01.
Observations flown(std::array<double, 4> built, int flights) {
  Observations seen;
  seen.flights = static_cast<std::size_t>(flights);
  seen.first = {0};
  for (int f = 0; f < flights; ++f) {
    for (int i = 0; i < 5; ++i) {
      seen.windows.emplace_back();
      for (std::size_t c = 0; c < kChannels; ++c) {
        const bool motor = c >= kMotor1 && c <= kMotor4;
        seen.weight[c].push_back(motor ? 1 : 0);
        seen.y[c].push_back(motor ? built[c - kMotor1] + 0.01 * (f % 3 - 1) * (c % 2 ? 1 : -1) : 0);
      }
    }
    seen.first.push_back(seen.windows.size());
  }
  seen.units.first = seen.first;
  return seen;
}

TEST(SoundRotors, AreLearntFromReferenceFlightsAndTakenOut) {
  const std::array<double, 4> built = {0.15, -0.1, -0.1, 0.05};
  const auto sound = sound_rotors(flown(built, 6));
  ASSERT_TRUE(sound);
  EXPECT_NEAR(sound->mean[0], 0.15, 1e-9);
  EXPECT_GE(sound->spread, 0.01);
  EXPECT_LT(sound->spread, 0.03);
  auto seen = flown({0.15 + 0.06, -0.1 - 0.02, -0.1 - 0.02, 0.05 - 0.02}, 12);
  const auto settled = settle_rotors(sound, seen);
  EXPECT_FALSE(settled.unjudged);
  EXPECT_NEAR(settled.seen.y[kMotor1][5], 0.06, 1e-9);
  EXPECT_FALSE(sound_rotors(flown(built, 3))) << "three flights are no reference";
}

TEST(SoundRotors, WithoutAReferenceWhatCraftDifferByIsNotJudgedAndWhatIsMoreStays) {
  const auto settled = settle_rotors(std::nullopt, flown({0.15, -0.1, -0.1, 0.05}, 12));
  EXPECT_NEAR(settled.unjudged.value_or(0), 0.15, 1e-9);
  EXPECT_NEAR(settled.seen.y[kMotor1][5], 0, 1e-9);
  const auto broken = settle_rotors(std::nullopt, flown({0.45, -0.15, -0.15, -0.15}, 12));
  EXPECT_FALSE(broken.unjudged);
  EXPECT_NEAR(broken.seen.y[kMotor1][5], 0.45, 1e-9);
}

TEST(SoundRotors, AreThoseOfTheSoundHalfOfTheFlights) {
  auto seen = flown({0.01, -0.01, 0, 0}, 12);
  for (std::size_t i = seen.first[6]; i < seen.windows.size(); ++i) seen.y[kMotor4][i] -= 0.4;
  seen = settle_rotors(std::nullopt, seen).seen;
  EXPECT_NEAR(seen.y[kMotor4][5], 0, 0.03);
  EXPECT_NEAR(seen.y[kMotor4].back(), -0.4, 0.03);
}

}  // namespace
}  // namespace backwash::study

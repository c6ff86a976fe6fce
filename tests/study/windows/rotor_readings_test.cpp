// SPDX-License-Identifier: BSD-3-Clause
// What a rotor's readings say of its sensor, however a log writes them down.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "core/study/windows/signals/rotor_channels.hpp"

namespace {

using namespace backwash::study;

constexpr std::size_t kRows = 100, kWindows = 30;

/// Readings of four rotors at 50 Hz that wander by 1.6 % together and are noisy by `noise`, rounded to `step`; in
/// `unit`.
struct Flown {
  backwash::log::FlightLog log;
  Series s;
  Flown(double step, double noise, double unit = 1, unsigned seed = 7) {
    std::mt19937_64 rng(seed);
    std::normal_distribution draw;
    double common = 0;
    std::array<double, 4> own{};
    for (std::size_t i = 0; i < kRows * kWindows; ++i) {
      s.t.push_back(0.02 * static_cast<double>(i));
      s.row.push_back(i);
      common += 0.1 * (0.04 * draw(rng) - 0.3 * common);
      for (std::size_t r = 0; r < 4; ++r) {
        own[r] += 0.1 * (0.003 * draw(rng) - 0.3 * own[r]);
        const double rpm = (10900 + 130 * static_cast<double>(r)) * (1 + common + own[r] + noise * draw(rng));
        log.columns[name(r)].push_back(unit * (step > 0 ? step * std::round(rpm / step) : rpm));
      }
    }
  }
  static std::string name(std::size_t rotor) { return "rpm" + std::to_string(rotor + 1); }

  /// Mean share of failing readings of each rotor.
  std::array<double, 4> failing() const {
    const auto phases = rotor_phases(log, s);
    const std::vector<double> residual(kRows * kWindows, 0.0);
    std::array<double, 4> mean{};
    for (std::size_t w = 0; w < kWindows; ++w) {
      std::array<std::optional<RotorLine>, 4> lines;
      const std::span own(residual.data(), kRows);
      for (const auto& value :
           rotor_values(log, s, phases, backwash::Vehicle{}, own, w * kRows, (w + 1) * kRows, w, lines))
        if (value.channel >= kDropout1 && value.channel < kDropout1 + 4)
          mean[value.channel - kDropout1] += value.value / static_cast<double>(kWindows);
    }
    return mean;
  }
};

TEST(RotorReadings, RoundedToAnyStepInAnyUnitAreNotStuck) {
  for (const double step : {0.0, 1.0, 10.0, 60.0, 100.0, 250.0, 600.0})
    for (const double noise : {0.0, 0.001, 0.004})
      for (const double unit : {1.0, 1 / 60.0, 0.10472})
        for (const double share : Flown(step, noise, unit).failing())
          EXPECT_NEAR(share, 0, 0.004) << step << " rpm, noise " << noise << ", unit " << unit;
}

TEST(RotorReadings, HeldByTheLogForSeveralRowsAreNotStuck) {
  Flown flown(0, 0.002);
  for (auto& [name, column] : flown.log.columns)
    for (std::size_t i = 0; i < column.size(); ++i) column[i] = column[i - i % 5];
  for (const double share : flown.failing()) EXPECT_NEAR(share, 0, 0.002);
}

/// What rounding hides is not told: of a sensor that is stuck the more, the coarser the step.
TEST(RotorReadings, OneThatIsStuckOrMissingIsToldThroughRoundingToo) {
  for (const auto& [step, least] : {std::pair(0.0, 0.9), {60.0, 0.6}, {100.0, 0.2}})
    for (const bool missing : {false, true}) {
      Flown flown(step, 0.002);
      auto& column = flown.log.columns[Flown::name(2)];
      double failed = 0;
      for (std::size_t i = 1; i < column.size(); ++i)
        if (i % 230 < 40) {  // 0.8 s of every 4.6 s
          column[i] = missing ? 0 : column[i - i % 230];
          failed += 1 / static_cast<double>(column.size());
        }
      const auto share = flown.failing();
      EXPECT_GT(share[2], (missing ? 0.99 : least) * failed) << step;
      EXPECT_LT(share[2], 1.05 * failed) << step;
      for (const std::size_t r : {0u, 1u, 3u}) EXPECT_NEAR(share[r], 0, 0.004) << step;
    }
}

}  // namespace

// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "core/study/calibrate/height_effect.hpp"
#include "core/study/import_airgarage.hpp"

namespace backwash::study::calibrate {
namespace {

TEST(ImportAirgarage, DifferentiatesFramesThatArriveLateAndInBursts) {
  // 1.5 Hz, 2 cm: the acceleration is known in closed form. 100 Hz frames, 40 % missing, every tenth 9 ms late.
  const auto path = std::filesystem::temp_directory_path() / ("20240901_" + std::to_string(::getpid()) + ".csv");
  {
    std::ofstream file(path);
    file.precision(15);
    file << "t,x,y,z,qx,qy,qz,qw\n";
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> uniform(0, 1);
    double last = 0;
    for (int k = 0; k < 1500; ++k) {
      if (uniform(random) < 0.4) continue;
      const double t = 0.01 * k, omega = 3 * std::numbers::pi;
      const double stamp = 1.7e9 + t + 3e-4 * uniform(random) + (k % 10 == 0 ? 0.0085 : 0);
      if (stamp <= last) continue;
      last = stamp;
      file << stamp << ",0,0," << 0.5 + 0.02 * std::sin(omega * t) << ",0,0,0,1\n";
    }
  }
  const auto log = import_airgarage(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(log) << log.error().message;
  double power = 0;
  for (const double a : log->column("az_mps2")) power += a * a / static_cast<double>(log->t_s.size());
  const double exact = 0.5 * std::pow(0.02 * std::pow(3 * std::numbers::pi, 2), 2);
  EXPECT_NEAR(power, exact, 0.12 * exact);
  EXPECT_EQ(log->column("day").front(), 20240901);
  EXPECT_EQ(log->column("ceiling").front(), -1);
}

TEST(HeightEffect, IsFreeOfTheDayThatHidesIt) {
  // Low hovers on a noisy day, high ones on a quiet day, both on a third; the effect itself is ×2.
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal;
  std::vector<HeightRow> rows;
  for (std::size_t flight = 0; flight < 60; ++flight) {
    const int day = static_cast<int>(flight % 3);
    const double level = (day == 0 ? 1.5 : 0.0) + 0.2 * normal(random);
    for (int w = 0; w < 10; ++w) {
      const bool low = day == 0 ? w < 9 : day == 1 ? w < 1 : w < 5;
      const double speed = 0.1 * normal(random);
      rows.push_back({flight, day, level + 0.8 * speed + (low ? std::log(2.0) : 0) + 0.5 * normal(random), speed,
                      low ? 1e-4 : 100.0, false});
    }
  }
  const auto effect = height_effect(rows, 1e-4, 100.0, 0.05, 200, 1);
  EXPECT_NEAR(effect.low_over_high.value, 2, 0.3);
  EXPECT_LT(effect.low_over_high.ci95.low, 2);
  EXPECT_GT(effect.low_over_high.ci95.high, 2);
  EXPECT_EQ(effect.ceiling.value, 0);
}

TEST(HeightEffect, OfTheRealRecordingsLiesWithinTheIntervalsThatComeWithThem) {
  const std::filesystem::path folder = std::filesystem::path(BACKWASH_SHARED_DATA) / "airgarage";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << folder << " is absent";
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".csv") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  WindowOptions options;
  options.still_mps = 10;  // passes too: speed is held fixed
  std::vector<HeightRow> rows;
  std::size_t number = 0, perched = 0;
  for (const auto& file : files) {
    const auto log = import_airgarage(file);
    if (!log || log->column("ceiling").front() < 0) continue;
    const auto flight = flight_windows(*log, std::nullopt, options, file);
    ASSERT_TRUE(flight) << flight.error().message;
    perched += flight->gated[static_cast<std::size_t>(Gate::perched)];
    for (const auto& w : flight->windows) {
      const double height = w.p_W.z() - log->column("surface_z_m").front() - 0.027;
      if (height < 0.005) continue;
      rows.push_back({number, static_cast<int>(log->column("day").front()), std::log(w.variance.z()),
                      std::log(w.speed_mps), height, log->column("ceiling").front() > 0});
    }
    ++number;
  }
  EXPECT_GT(perched, 100u);  // every flight begins on the ground
  const auto effect = height_effect(rows, 0.01, 0.8, 0.05, 500, 1);
  EXPECT_GT(effect.low_over_high.value, 1.23);
  EXPECT_LT(effect.low_over_high.value, 2.22);
  EXPECT_GT(effect.ceiling.value, 1.23);
  EXPECT_LT(effect.ceiling.value, 2.04);
}

}  // namespace
}  // namespace backwash::study::calibrate

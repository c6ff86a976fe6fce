// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/calibrate/calibrate.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "core/field/disturbance_field.hpp"
#include "core/sim/airflow_truth.hpp"
#include "core/sim/hover_flight.hpp"
#include "core/study/calibrate/model_text.hpp"
#include "tests/study/calibrate_support.hpp"

namespace backwash::study::calibrate {
namespace {

const Corridors& five_inch() {
  static const Corridors corridors("quad-5in");
  return corridors;
}

Data truth_campaign(const Corridors& corridors, int flights, std::uint64_t seed) {
  return sampled(corridors, flights, seed, [&](std::size_t m, std::size_t i) { return corridors.places[m].truth[i]; });
}

std::vector<double> once(const Data& data) { return std::vector<double>(data.place.size(), 1.0); }

TEST(CalibrateFeatures, ReproduceTheExactFieldForAnyConstants) {
  const auto grid = map::builtin_scene("apartment").value();
  auto model = config::load_model("builtin:quad-5in").value();
  model.ground.k2 = 2.2;
  model.wall.k2 = 6.1;  // between the stored decays
  model.corner.lambda.normal = 0.07;
  model.wall.k1.vertical = 0.4;
  const std::vector<Vec3> at = {{3, 4, 1.2}, {0.4, 4.6, 0.6}, {5.5, 2.0, 1.0}, {7.2, 1.8, 0.9}, {9.3, 5.5, 1.3}};
  const auto found = features(grid, model, at);
  const field::ProximityField exact(grid, model);
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Variance sigma = exact.at(at[i]).sigma();
    const Vec3 linear = bound_variance(found[i], parameters_of(model));
    EXPECT_NEAR(linear.x(), sigma.xx, 2e-3 * sigma.xx);
    EXPECT_NEAR(linear.y(), sigma.yy, 2e-3 * sigma.yy);
    EXPECT_NEAR(linear.z(), sigma.zz, 2e-3 * sigma.zz);
  }
}

TEST(CalibrateFit, FindsTheConstantsThatMadeTheDataWhenNothingScatters) {
  const auto& corridors = five_inch();
  auto wanted = corridors.gates;
  wanted.wall.k1 = {0.5, 0.05, 0.2};
  wanted.wall.k2 = 4;
  wanted.ground.k2 = 2;
  wanted.base = {0.01, 0.004};
  const auto parameters = parameters_of(wanted);
  const auto data = sampled(
      corridors, 3, 5,
      [&](std::size_t m, std::size_t i) { return bound_variance(corridors.places[m].features[i], parameters); }, 0,
      0.002);
  FitOptions options;
  options.quantile = 0.5;
  const Fit found = fit(data, once(data), parameters_of(corridors.gates), options);
  for (std::size_t p = 0; p < kParameters; ++p)
    EXPECT_NEAR(found.parameters[p], parameters[p], 0.05 * parameters[p]) << key(static_cast<Parameter>(p));
}

TEST(CalibrateFit, ANoisyDayBesideTheWallDoesNotBecomeAWall) {
  const auto& corridors = five_inch();
  auto data = truth_campaign(corridors, 8, 11);
  FitOptions options;
  const Fit before = fit(data, once(data), parameters_of(corridors.gates), options);
  // One more flight in the widest corridor: 80 hovers, all within 0.6 m of the wall, 4.5 times the variance.
  const auto& wide = corridors.places[0];
  data.place.push_back(0);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < 80 * wide.features.size(); ++i) {
    const auto spot = i % wide.features.size();
    if (wide.features[spot].wall_distance > 0.6) continue;
    if (std::count_if(data.hovers.begin(), data.hovers.end(),
                      [&](const Hover& h) { return h.flight == data.place.size() - 1; }) >= 80)
      break;
    Hover hover{data.place.size() - 1, Vec3::Zero(), wide.features[spot], {}, {}, {}, {}};
    hover.ln_variance.push_back(wide.truth[spot].array().log() + 1.5);
    for (int axis = 0; axis < 3; ++axis) hover.ln_variance.back()[axis] += 0.55 * normal(random);
    data.hovers.push_back(hover);
  }
  const Fit after = fit(data, once(data), parameters_of(corridors.gates), options);
  // The whole bound grows with the scatter between flights; beside the wall it does not grow more than elsewhere.
  EXPECT_GT(after.between_sd[kHorizontal], before.between_sd[kHorizontal]);
  Vec3 grown[2] = {Vec3::Zero(), Vec3::Zero()};  // mean ln growth far from and beside the wall
  double count[2] = {0, 0};
  for (const auto& f : wide.features) {
    const int beside = f.wall_distance < 0.6 ? 1 : f.wall_distance > 1.2 ? 0 : -1;
    if (beside < 0) continue;
    grown[beside] +=
        Vec3((bound_variance(f, after.parameters).array() / bound_variance(f, before.parameters).array()).log());
    count[beside] += 1;
  }
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(grown[1][axis] / count[1], grown[0][axis] / count[0], 0.25) << "axis " << axis;
}

class HeldOut : public ::testing::TestWithParam<std::tuple<const char*, double>> {};

TEST_P(HeldOut, ShareOfWindowsIsTheQuantileAskedForAndTheBoundIsSharp) {
  const auto [name, q] = GetParam();
  const Corridors corridors(name);
  FitOptions options;
  options.quantile = q;
  const auto train = truth_campaign(corridors, 20, 21), test = truth_campaign(corridors, 60, 22);
  const Fit found = fit(train, once(train), parameters_of(corridors.gates), options);
  const auto a = assess(test, ln_bounds(test, found.parameters), q);
  EXPECT_NEAR(a.coverage.mean(), q, 0.05);
  for (const auto* bins : {&a.by_wall_distance, &a.by_height}) {
    for (const auto& bin : *bins) {
      if (bin.windows < 500) continue;
      EXPECT_NEAR(bin.coverage.mean(), q, 0.08) << bin.low << " m";
    }
  }
  EXPECT_LT(a.loss, 0.80 * a.constant_loss);
  EXPECT_LT(a.loss, 0.90 * a.height_loss);
}

INSTANTIATE_TEST_SUITE_P(Quantiles, HeldOut,
                         ::testing::Combine(::testing::Values("quad-5in", "quad-7in"),
                                            ::testing::Values(0.80, 0.90, 0.95)));

TEST(CalibrateIntervals, CoverTheConstantsThatMadeTheData) {
  const auto& corridors = five_inch();
  constexpr double kQuantile = 0.9, kNormal = 1.2815516;  // of the standard normal
  auto wanted = parameters_of(corridors.gates);
  for (std::size_t p = 0; p < kAmplitudes; ++p) wanted[p] *= std::exp(kNormal * std::hypot(0.35, 0.55));
  int inside = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 16; ++seed) {
    const auto data = sampled(corridors, 10, 100 + seed, [&](std::size_t m, std::size_t i) {
      return bound_variance(corridors.places[m].features[i], parameters_of(corridors.gates));
    });
    Options options;
    options.fit.quantile = kQuantile;
    options.bootstraps = 60;
    options.seed = seed;
    options.folds = 2;
    const auto c = calibrate(data, corridors.gates, {}, false, options);
    for (std::size_t p = 0; p < kParameters; ++p) {
      inside += c.ci95[p].low <= wanted[p] && wanted[p] <= c.ci95[p].high ? 1 : 0;
      all += 1;
    }
  }
  // 0.909 over 25 campaigns (docs/measurements/calibration.md); 16 campaigns scatter by about 0.02.
  EXPECT_GE(static_cast<double>(inside) / all, 0.86);
  EXPECT_LE(static_cast<double>(inside) / all, 0.995);
}

/// One flight through simulated vehicle, CSV and windows.
std::vector<Hover> flown(const Corridors& corridors, std::size_t place, std::size_t number, std::uint64_t seed,
                         const map::OccupancyGrid& grid) {
  const double reach = std::array{2.0, 1.0, 0.5}[place] - corridors.vehicle.body.radius - 0.1;
  const sim::HoverGrid points{{0, -reach, 0.4}, {0, reach, 2.1}, {1, 3, 3}, 0.03, 9};
  const sim::HoverFlight flight{{0, 0, 1}, seed, 0.35, sim::hover_points(points, seed)};
  const auto path =
      std::filesystem::temp_directory_path() / ("backwash_calibrate_" + std::to_string(::getpid()) + ".csv");
  EXPECT_TRUE(log::write_csv(path, sim::to_log(sim::fly_hovers(grid, corridors.vehicle, flight)), true));
  const auto log = log::read_csv(path);
  std::filesystem::remove(path);
  const auto windows = flight_windows(*log, corridors.vehicle, {}, "log.csv");
  EXPECT_TRUE(windows);
  EXPECT_EQ(windows->windows.size(), 36u);  // nine hovers of 1 + 4·2 s
  return hovers_of(*windows, number, grid, corridors.gates);
}

/// ∫ρ dt of the airflow at one place over 5.5 h, without vehicle, band or window, s.
double integral_time_of_the_air(const Vehicle& vehicle) {
  const auto grid = map::builtin_scene(Corridors::kMaps[0]).value();
  sim::AirflowTruth air(grid, vehicle, 7);
  constexpr std::size_t kSamples = 1'000'000, kLags = 50;
  constexpr double kStep = 0.02;
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> w;
    double mean = 0;
    for (std::size_t k = 0; k < kSamples; ++k) {
      w.push_back(air.step({0, 0, 1}, kStep)[axis]);
      mean += w.back() / kSamples;
    }
    const auto with = [&](std::size_t lag) {
      double product = 0;
      for (std::size_t k = lag; k < kSamples; ++k) product += (w[k] - mean) * (w[k - lag] - mean);
      return product;
    };
    const double power = with(0);
    sum += kStep / 2;
    for (std::size_t lag = 1; lag < kLags; ++lag) sum += kStep * with(lag) / power;
  }
  return sum / 3;
}

TEST(CalibrateFlights, LogsOfSimulatedFlightsGiveABoundThatHoldsForOtherFlights) {
  const auto& corridors = five_inch();
  Data train, test;
  for (std::size_t m = 0; m < 3; ++m) {
    const auto grid = map::builtin_scene(Corridors::kMaps[m]).value();
    for (std::uint64_t f = 0; f < 16; ++f) {
      Data& data = f % 2 ? test : train;
      const auto hovers = flown(corridors, m, data.place.size(), 100 * m + f, grid);
      data.hovers.insert(data.hovers.end(), hovers.begin(), hovers.end());
      data.place.push_back(m);
    }
  }
  ASSERT_TRUE(refusals(train, corridors.gates).empty());
  Options options;
  options.bootstraps = 20;
  const auto c = calibrate(train, corridors.gates, {}, true, options);
  const auto a = assess(test, ln_bounds(test, c.fitted.parameters), 0.9);
  EXPECT_NEAR(a.coverage.mean(), 0.9, 0.05);
  EXPECT_LT(a.loss, 0.80 * a.constant_loss);
  const double tau_w = integral_time_of_the_air(corridors.vehicle);
  EXPECT_NEAR(c.tau_w.value, tau_w, 0.1 * tau_w);
  EXPECT_LT(c.tau_w.ci95.low, tau_w);
  EXPECT_GT(c.tau_w.ci95.high, tau_w);
  // What the simulator's own documentation says of its airflow: pushes of at most 0.04 m/s².
  ASSERT_TRUE(c.push);
  EXPECT_GT(c.push->horizontal.value, 0.01);
  EXPECT_LT(c.push->horizontal.value, 0.08);
  EXPECT_GT(c.fitted.within_sd[kHorizontal], 0.4);
  EXPECT_LT(c.fitted.within_sd[kHorizontal], 0.9);
}

std::string named(const std::vector<Refusal>& refused) {
  std::string names;
  for (const auto& r : refused) {
    EXPECT_FALSE(r.flight.empty());
    names += r.what + " ";
  }
  return names;
}

TEST(CalibrateRefusals, NameWhatTheFlightsCannotDetermine) {
  const auto& corridors = five_inch();
  const auto whole = truth_campaign(corridors, 3, 31);
  EXPECT_EQ(named(refusals(whole, corridors.gates)), "");
  const auto without = [&](auto unwanted) {
    Data data = whole;
    std::erase_if(data.hovers, unwanted);
    return named(refusals(data, corridors.gates));
  };
  EXPECT_EQ(without([](const Hover& h) { return h.features.wall[0] > 0; }), "wall corner ");
  EXPECT_EQ(without([](const Hover& h) { return std::abs(h.features.wall_distance - 0.45) > 0.08; }), "wall ");
  EXPECT_EQ(without([](const Hover& h) { return std::abs(h.features.height - 0.6) > 0.09; }).find("ground"), 0u);
  EXPECT_EQ(without([](const Hover& h) { return h.features.corner > 0; }), "corner ");
  EXPECT_EQ(without([](const Hover&) { return true; }), "all ");
  EXPECT_EQ(named(refusals(truth_campaign(corridors, 1, 31), corridors.gates)), "all ");
}

TEST(CalibrateModelFile, IsReadBackByTheReaderOfEveryProgram) {
  const auto& corridors = five_inch();
  const auto data = truth_campaign(corridors, 3, 41);
  Options options;
  options.bootstraps = 20;
  const std::vector<Refusal> refused = {{"wall", {kWallN, kWallT, kWallZ, kWallK2}, "why", "flight"}};
  const auto c = calibrate(data, corridors.gates, refused, false, options);
  const auto path = std::filesystem::temp_directory_path() / ("backwash_model_" + std::to_string(::getpid()) + ".toml");
  Provenance from;
  from.logs = {"a \"quoted\\name\".csv"};
  from.quantile = 0.9;
  std::ofstream(path) << model_text(c, from);
  const auto read = config::load_model(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(read) << read.error().message;
  const auto written = parameters_of(*read), gates = parameters_of(corridors.gates);
  for (std::size_t p = 0; p < kParameters; ++p)
    EXPECT_NEAR(written[p], c.fitted.parameters[p], 1e-5 * c.fitted.parameters[p]);
  for (const Parameter p : {kWallN, kWallT, kWallZ, kWallK2}) EXPECT_DOUBLE_EQ(written[p], gates[p]);
  EXPECT_EQ(read->ground.r0, corridors.gates.ground.r0);
}

}  // namespace
}  // namespace backwash::study::calibrate

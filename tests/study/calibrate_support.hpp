// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <random>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/sim/airflow_truth.hpp"
#include "core/study/calibrate/calibrate.hpp"

namespace backwash::study::calibrate {

/// Places where a vehicle hovers in the three corridors, with their features and the airflow truth's variance there.
struct Corridors {
  static constexpr std::array<const char*, 3> kMaps = {"parallel-walls-4m", "parallel-walls-2m", "parallel-walls-1m"};
  struct Place {
    std::vector<Features> features;
    std::vector<Vec3> truth;
  };
  Vehicle vehicle;
  Model gates;
  std::array<Place, 3> places;

  explicit Corridors(const std::string& name, std::size_t spots = 90, std::uint64_t seed = 3)
      : vehicle(config::load_vehicle("builtin:" + name).value()), gates(config::load_model("builtin:" + name).value()) {
    gates.ground.r0 = vehicle.body.diagonal_radius;
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (std::size_t m = 0; m < 3; ++m) {
      const auto grid = map::builtin_scene(kMaps[m]).value();
      const sim::AirflowTruth truth(grid, vehicle, 1);
      const double reach = std::array{2.0, 1.0, 0.5}[m] - vehicle.body.radius - 0.1;
      std::vector<Vec3> at;
      for (std::size_t i = 0; i < spots; ++i)
        at.emplace_back(2 * uniform(random) - 1, reach * (2 * uniform(random) - 1), 0.25 + 2.1 * uniform(random));
      places[m].features = features(grid, gates, at);
      for (const auto& p : at) places[m].truth.push_back(truth.variance(p));
    }
  }
};

/// Flights of 20 hovers of four windows in each corridor. `sigma(place, spot)`: variance before the scatter of flights
/// (sd of ln variance 0.35) and windows (0.55) about as in real recordings.
template <typename Sigma>
Data sampled(const Corridors& corridors, int flights_per_corridor, std::uint64_t seed, Sigma sigma,
             double between = 0.35, double within = 0.55) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Data data;
  for (std::size_t m = 0; m < 3; ++m) {
    for (int f = 0; f < flights_per_corridor; ++f) {
      const double level = between * normal(random);
      data.place.push_back(m);
      for (int h = 0; h < 20; ++h) {
        const auto spot = static_cast<std::size_t>(random() % corridors.places[m].features.size());
        Hover hover{data.place.size() - 1, Vec3::Zero(), corridors.places[m].features[spot], {}, {}, {}, {}};
        const Vec3 ln = Vec3(sigma(m, spot)).array().log() + level;
        for (int w = 0; w < 4; ++w)
          hover.ln_variance.push_back(ln + within * Vec3(normal(random), normal(random), normal(random)));
        hover.push = hover.push_noise = Vec3::Zero();
        hover.tau_w = 0.15;
        data.hovers.push_back(hover);
      }
    }
  }
  return data;
}

}  // namespace backwash::study::calibrate

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/field/disturbance_field.hpp"
#include "core/plan/planner.hpp"
#include "research/compare/compare.hpp"

// What is raced: vehicles with their loops, maps, pairs of hover points, ways of keeping clear, and calibrated worlds.
namespace backwash::race {

inline constexpr double kAirs[] = {0.25, 1, 4};  ///< on the variance of core/sim/airflow_truth

/// Every vehicle of the population, by name.
const std::vector<Vehicle>& population();
const Vehicle& vehicle_named(std::string_view name);

/// A way of keeping clear: a stated risk, a constant margin (m), or neither: the worst case.
struct Way {
  std::string name;
  std::optional<double> risk, margin;
};
/// tight, three risks, and margins of 0 to 0.6 m in steps of 0.05 m, rising.
const std::vector<Way>& ways();

/// A map, and what depends on it and on a body alone.
struct Place {
  std::string name;
  map::OccupancyGrid grid;
  map::DistanceField distance;
  map::OccupancySums sums;
};
/// Built-in names, "gaps", and the file of geb079.
const std::vector<std::string>& maps();
Place place_named(const std::string& name);
/// "gaps" is a row of rooms with doors of 0.6 to 1.2 m: the door of a pair, m.
double door_of(std::size_t pair);
/// Pairs of hover points of a vehicle's own; nothing where the body does not fit.
std::vector<sim::RoutePair> pairs_of(const Place& place, const Vehicle& vehicle, std::size_t count);

/// What this vehicle's own hover flights say of its air: one factor on the model's variances, its upper limit of 95 %,
/// and the largest steady push seen. 22 s at each of five places between walls, as VIO and accelerometer tell it.
struct Calibrated {
  double factor = 1;
  BoundModel bound;
};
Calibrated calibrated(const Vehicle& vehicle, double strength);

/// Worlds of one place and vehicle: Σ of the model is found once.
class Worlds {
 public:
  Worlds(const Place& place, const Vehicle& vehicle, const Parallel& parallel);
  plan::World make(const Calibrated& air, const Way& way, const Parallel& parallel) const;
  const reach::Reachability& reach() const noexcept { return reach_; }

 private:
  const Place& place_;
  std::vector<std::size_t> voxels_;
  field::DisturbanceField field_;
  reach::Reachability reach_;
};

/// The plan of a pair, from rest.
plan::Plan planned(const plan::World& world, const sim::RoutePair& pair, double v_max);

}  // namespace backwash::race

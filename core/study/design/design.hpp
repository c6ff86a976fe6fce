// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/plan/world/world.hpp"
#include "core/study/design/design_rules.hpp"
#include "core/study/design/divergence.hpp"
#include "core/study/findings/study.hpp"
#include "core/types/waypoint.hpp"

namespace backwash::study {

/// A set that the flights do not tell apart: names, the named one first, their probabilities, and its pairs.
struct DesignedSet {
  std::vector<std::string> names;
  std::vector<double> probability;
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
};

/// A flight that fits in the map.
struct NextFlight {
  std::string name;
  bool used_battery;                         ///< to be begun where the flights at hand ended
  std::optional<double> voltage;             ///< V at take-off
  std::vector<Waypoint> points;              ///< rows of the points file
  std::vector<Setpoint> commands;            ///< 20 ms apart
  double divergence;                         ///< T, nats a flight, over all sets
  std::vector<std::vector<double>> of_pair;  ///< by set and pair: ½ (T_ij + T_ji), nats a flight
  std::optional<int> flights;  ///< after so many every set is one name with P ≥ 0.9; not up to most_flights: none
  double separated;            ///< P after so many, or after most_flights
};

struct Design {
  std::vector<DesignedSet> sets;                              ///< empty: there is nothing to tell apart
  std::vector<NextFlight> flights;                            ///< best first
  std::vector<std::pair<std::string, std::string>> left_out;  ///< name, why it does not fit in the map
  std::string message;                                        ///< one sentence: what to fly, or why nothing
  /// The first of `flights` if it separates; else null.
  const NextFlight* chosen() const;
};

/// The next flight of a study that could not distinguish: of every manoeuvre that the planner verifies in this world
/// from `start_W` (m), which tells the sets apart in the fewest flights (docs/model.md section 6). `seen`: what
/// `result` was found in; `flight_time`: of each flight, s. Real-time status: offline, seconds.
Design design(const Observations& seen, const StudyResult& result, const plan::World& world, const Model& model,
              const Vec3& start_W, double flight_time = kDesignRules.design_flight_time);

/// As `backwashctl follow` reads it (docs/interfaces.md, "Points CSV"). Headings have a column where there is one.
std::string points_csv(const std::vector<Waypoint>& points);

}  // namespace backwash::study

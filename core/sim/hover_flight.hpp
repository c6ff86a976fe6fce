// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/sim/flight.hpp"

namespace backwash::sim {

/// A flight from hover point to hover point on straight lines.
struct HoverFlight {
  struct Hover {
    Vec3 p_W;        ///< m
    double dwell_s;  ///< s
  };
  Vec3 start_W;            ///< where the vehicle hovers at first, m
  std::uint64_t seed = 1;  ///< of airflow, VIO error and strength
  double strength_sd =
      0;  ///< of the logarithm of the airflow's variance between flights: this one's is drawn from seed
  std::vector<Hover> hovers;
};

/// Points of a grid from `low` to `high` (m; a count of 1: the middle), back and forth so that neighbours follow each
/// other: x fastest, z slowest. Each is moved at random by up to `jitter` (m) along each axis with more than one point.
struct HoverGrid {
  Vec3 low, high;
  Index3 count;
  double jitter = 0, dwell_s = 10;
};
std::vector<HoverFlight::Hover> hover_points(const HoverGrid& grid, std::uint64_t seed);

/// Flies it (20 ms rows): rest to rest within the vehicle's limits; `segment` is the hover's number from 0, −1 on the
/// way. Lines are not checked against obstacles. Deterministic for its seed. About 2 ms per second of flight.
/// `simulation`: its strength is that of the flight.
std::vector<FlightSample> fly_hovers(const map::OccupancyGrid& grid, const Vehicle& vehicle, const HoverFlight& flight,
                                     Simulation simulation = {});

}  // namespace backwash::sim

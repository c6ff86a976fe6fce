// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/hover_flight.hpp"

#include <cmath>
#include <random>

#include "core/types/minimum_jerk.hpp"

namespace backwash::sim {

std::vector<HoverFlight::Hover> hover_points(const HoverGrid& grid, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };  // −1 … 1
  std::vector<HoverFlight::Hover> points;
  bool back_y = false, back_x = false;
  for (int k = 0; k < grid.count.z(); ++k, back_y = !back_y) {
    for (int j = 0; j < grid.count.y(); ++j, back_x = !back_x) {
      for (int i = 0; i < grid.count.x(); ++i) {
        const Index3 at(back_x ? grid.count.x() - 1 - i : i, back_y ? grid.count.y() - 1 - j : j, k);
        Vec3 p = 0.5 * (grid.low + grid.high);
        for (int axis = 0; axis < 3; ++axis) {
          if (grid.count[axis] < 2) continue;
          const double share = static_cast<double>(at[axis]) / (grid.count[axis] - 1);
          p[axis] = grid.low[axis] + share * (grid.high[axis] - grid.low[axis]) + grid.jitter * uniform();
        }
        points.push_back({p, grid.dwell_s});
      }
    }
  }
  return points;
}

std::vector<FlightSample> fly_hovers(const map::OccupancyGrid& grid, const Vehicle& vehicle, const HoverFlight& flight,
                                     Simulation simulation) {
  std::mt19937_64 random(flight.seed ^ 0x5bd1e995u);
  std::normal_distribution<double> normal;
  simulation.strength = std::exp(flight.strength_sd * normal(random));
  ClosedLoop loop(grid, vehicle, {flight.start_W, Vec3::Zero()}, flight.seed, simulation);
  std::vector<FlightSample> samples;
  const auto follow = [&](std::span<const Setpoint> commands, std::optional<int> segment) {
    for (const auto& command : commands) {
      samples.push_back(loop.sample(command, segment));
      loop.fly(command);
    }
  };
  Vec3 at = flight.start_W;
  int number = 0;
  for (const auto& hover : flight.hovers) {
    const auto way = rest_to_rest(at, hover.p_W, vehicle.limits.v_max, vehicle.limits.a_max);
    if ((hover.p_W - at).norm() > 0) follow(std::span(way).subspan(1), {});
    follow(hold_commands(hover.p_W, hover.dwell_s), number++);
    at = hover.p_W;
  }
  return samples;
}

}  // namespace backwash::sim

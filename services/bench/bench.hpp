// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>

#include "core/map/occupancy_grid.hpp"
#include "core/types/vehicle.hpp"
#include "services/bench/autopilot.hpp"

namespace backwash::bench {

struct Options {
  std::string map, vehicle, link, log, wire;
  Vec3 start = Vec3::Zero();  ///< above the place where the vehicle stands, m
  LocalFrame frame;
  std::uint64_t seed = 1;
  int domain = 0;
  std::string interface = "lo", name_space = "backwash";
  double duration_s = 600;
  std::optional<double> stop_odometry_s, stop_heartbeat_s;  ///< s after arming
  std::map<std::string, double> parameters;                 ///< of the autopilot, in place of its own
  /// A crate of which an emulated depth camera sends scans (10 Hz, body frame) from then on.
  std::optional<double> crate_s;  ///< s after arming
  Vec3 crate = Vec3::Zero();      ///< its centre in the map, m
  double crate_edge = 0.6;        ///< m
  /// The VIO drifts by −drift before the flight: odometry comes in the frame odom, and a loop closure, map ← odom,
  /// brings the drift to light.
  std::optional<double> closure_s;  ///< s after arming
  Vec3 drift = Vec3::Zero();        ///< m
};

/// Runs the emulated flight controller, VIO (100 Hz) and mapper in real time until the duration has passed or SIGINT or
/// SIGTERM. Returns the exit code; throws std::runtime_error at start.
int run(const Options& options, const map::OccupancyGrid& grid, const Vehicle& vehicle);

}  // namespace backwash::bench

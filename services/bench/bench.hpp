// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>

#include "core/config/odometry_profile.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/types/vehicle.hpp"
#include "services/bench/emulation/autopilot.hpp"
#include "services/bench/emulation/faults.hpp"
#include "services/bench/transit.hpp"

namespace backwash::bench {

struct Options {
  std::string map, vehicle, link, log, wire;
  enum class Profile { simple, ardupilot, px4 };
  Profile autopilot = Profile::simple;  ///< the last two fly with the vehicle file's gains as their parameters
  std::string in_loop;  ///< line to a real controller that is simulated for, in place of an emulated one; empty: none
  Vec3 start = Vec3::Zero();  ///< above the place where the vehicle stands, m
  LocalFrame frame;
  std::uint64_t seed = 1;
  int domain = 0;
  std::string interface = "lo", name_space = "backwash";
  std::string security;  ///< folder of credentials of DDS Security; empty: none
  double duration_s = 600;
  std::optional<double> stop_odometry_s, stop_heartbeat_s;  ///< s after arming
  std::map<std::string, double> parameters;                 ///< of the autopilot, in place of its own
  /// A crate's centre, m: an emulated depth camera sends scans of it (10 Hz, body frame) from the event on.
  std::optional<Vec3> crate;
  double crate_edge = 0.4;  ///< m
  /// Opposite corners of a box that the map which is sent leaves out, m: a range sensor on the vehicle finds what is in
  /// it (4 Hz, body frame, once armed).
  std::optional<std::array<Vec3, 2>> hidden;
  /// The VIO has drifted by −drift before the flight: odometry comes in the frame odom, and a loop closure, map ← odom,
  /// brings it to light at the event, m.
  std::optional<Vec3> drift;
  /// As which estimator of config::odometry_profiles() the odometry is filled, with the map in its frame; empty: in
  /// `map`, as the message's definition says.
  std::string estimator;
  config::PoseMessage message = config::PoseMessage::odometry;  ///< that the poses go out in
  Pace odometry;                                                ///< of the emulated VIO
  Timeline timeline;
  double event_x = 0;  ///< the event: the armed vehicle has passed this x of the map, m
};

/// Runs the emulated flight controller, VIO and mapper in real time until the duration has passed or SIGINT or
/// SIGTERM. Returns the exit code, 1 when an expectation of the timeline failed; throws StartError at start.
int run(const Options& options, const map::OccupancyGrid& grid, const Vehicle& vehicle);

}  // namespace backwash::bench

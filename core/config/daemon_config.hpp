// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "core/config/config.hpp"
#include "core/config/key_file.hpp"
#include "core/config/link_device.hpp"
#include "core/config/map_window.hpp"
#include "core/config/odometry_profile.hpp"
#include "core/types/odometry_timing.hpp"
#include "core/types/state.hpp"

namespace backwash::config {

/// Transforms that the daemon sends: none; frames.odometry in frames.map; the body in one of these too.
enum class Transforms { none, map, vehicle };

/// The daemon's one configuration file (an example with comments: files/backwashd.daemon.toml).
struct Daemon {
  std::string vehicle, model;  ///< files, or builtin:NAME
  struct {
    int domain = 0;
    std::string interface;             ///< network interface by name
    std::string name_space;            ///< topics are rt/NAMESPACE/…: several vehicles share a domain
    std::string odometry_topic;        ///< whole name on the wire, for any VIO
    Transforms tf = Transforms::none;  ///< what is sent on rt/tf
    std::string security;              ///< folder of credentials of DDS Security; empty: everyone may speak
  } dds;
  struct {
    std::string map = "map";         ///< of maps, clouds, odometry and what the daemon sends
    std::string odometry = "odom";   ///< of odometry and clouds of a VIO whose loop closures come as map ← odom
    std::string body = "base_link";  ///< child frame of odometry; clouds
  } frames;
  struct Odometry {
    PoseMessage message = PoseMessage::odometry;  ///< that the poses come in; without a twist unless it is odometry
    Twist twist = Twist::body;                    ///< of the profile, or of a custom one
    std::string child;                            ///< child frame of odometry; empty: frames.body
    Vec3 sensor_B = Vec3::Zero();                 ///< origin of what the estimator tells the pose of, in the body, m
    Vec3 sensor_turned = Vec3::Zero();            ///< its axes in the body: roll, pitch, yaw about fixed axes, rad
    OdometryTiming timing;                        ///< of the profile, unless the file says it
  } odometry;
  struct {
    bool live = false;           ///< a mapper is declared: a late map is a fault (docs/faults.md row 13)
    double closing_speed = 0.2;  ///< by which the age of a live map shrinks the trusted clearance, m/s
    double sensor_range = 8;     ///< points farther away only free the way up to there, m
    double max_mib = kMaxMib;    ///< largest snapshot made of a map, MiB
    MapWindow window;            ///< of a mapper that says what is around the vehicle
  } map;
  struct {
    std::string device;   ///< as written: for messages
    LinkDevice endpoint;  ///< the same, read
    LinkProtocol protocol = LinkProtocol::mavlink;
    int baud = 0;                          ///< of a serial port, or, with a share, of the line behind a socket
    std::optional<double> share;           ///< of that rate which is ours; absent: nearly all of a serial port's
    int system = 1;                        ///< MAVLink system id of the vehicle
    std::optional<SecretKey> signing_key;  ///< of MAVLink's signatures, both ways; absent: none are made or asked for
  } link;
  std::optional<double> risk;  ///< of a touch, in each flight and each minute at rest; none: the worst case is kept
  struct {
    int priority = 0;         ///< SCHED_FIFO priority of the control thread; 0: ordinary scheduling
    std::optional<int> cpu;   ///< processor that the control thread is bound to; none: any
    double battery_land = 0;  ///< remaining share below which LAND is asked for, once; 0: never
  } control;
  struct Gpio {
    std::string chip;                      ///< device of the chip, or its label; empty: no line is used
    std::string stop_switch, strobe, led;  ///< lines by name; empty: there is none
  } gpio;
  struct Adaptation {
    bool enabled = false;  ///< sets grow in flight where the air is shown to be rougher than modelled
    double alpha = 0.01;   ///< probability of a flight in which that is said wrongly (docs/model.md section 7)
    double calmest =
        1;             ///< down to it sets shrink at rest in air shown to be calmer: the calibrated lower end; 1: none
    std::string file;  ///< where the factors are kept over restarts; empty: they are not
  } adaptation;
  struct {
    std::string file;       ///< raw log; a start that finds it makes the next of NAME-2, NAME-3 …
    double max_mib = 1024;  ///< a file that has become larger is followed by the next, once the mode is passive
  } log;
};

/// Reads it, strictly: an unknown, missing or out-of-range key is an error naming file, line, key, value and range.
/// The key file is read here, so that a start with a bad one ends before any port opens.
/// `builtin:backwashd` is the shipped example.
tl::expected<Daemon, ConfigError> load_daemon(const std::string& path);

}  // namespace backwash::config

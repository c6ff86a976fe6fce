// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <iostream>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "services/bench/bench.hpp"
#include "version.hpp"

namespace {

int failed(int code, const std::string& message) {
  std::cerr << "backwash-bench: " << message << "\n";
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "backwash-bench: emulated flight controller on a pty, emulated VIO and mapper on DDS, in real time.\n"
      "Example: backwash-bench --map builtin:apartment --start 2,2,1.2 --link /tmp/autopilot"};
  app.set_version_flag("--version", std::string("backwash-bench ") + backwash::kVersion);
  backwash::bench::Options o;
  std::vector<double> start, origin{12.0, -7.0, 0.3};
  o.frame.yaw = 0.6;
  o.vehicle = "builtin:quad-5in";
  app.add_option("--map", o.map, "OctoMap file or builtin:NAME")->required();
  app.add_option("--vehicle", o.vehicle, "vehicle file or builtin:NAME")->capture_default_str();
  app.add_option("--start", start, "x,y,z above the place where the vehicle stands, m")
      ->required()
      ->delimiter(',')
      ->expected(3);
  app.add_option("--link", o.link, "symbolic link to make to the controller's serial port")->required();
  app.add_option("--seed", o.seed, "of the airflow and of the VIO's drift")->capture_default_str();
  app.add_option("--local-yaw", o.frame.yaw, "yaw of the controller's own frame, rad")->capture_default_str();
  app.add_option("--local-origin", origin, "the map's origin in the controller's own frame, m")
      ->delimiter(',')
      ->expected(3);
  app.add_option("--domain", o.domain, "DDS domain")->capture_default_str();
  app.add_option("--interface", o.interface, "network interface")->capture_default_str();
  app.add_option("--namespace", o.name_space, "the daemon's name space")->capture_default_str();
  app.add_option("--duration", o.duration_s, "s")->capture_default_str();
  app.add_option("--log", o.log, "flight log of the truth, CSV");
  app.add_option("--wire", o.wire, "what arrived from the daemon, frame by frame, CSV");
  app.add_option("--stop-odometry", o.stop_odometry_s, "fault: VIO stops this long after arming, s");
  app.add_option("--stop-heartbeat", o.stop_heartbeat_s, "fault: the controller goes silent this long after arming, s");
  app.add_option("--autopilot", o.autopilot, "simple, or as measured of a real one: ardupilot, px4")
      ->check(CLI::IsMember({"simple", "ardupilot", "px4"}))
      ->capture_default_str();
  std::string timeline;
  app.add_option("--faults", timeline,
                 "timeline of faults and of what the flight shall keep, TOML; services/bench/README.md");
  std::vector<std::string> parameters;
  app.add_option("--parameter", parameters, "NAME=NUMBER: an autopilot's parameter, in place of its own");
  std::vector<double> crate, drift, hidden;
  app.add_option(
         "--hide", hidden,
         "x,y,z,x,y,z: corners of a box that the map leaves out, m; a range sensor on the vehicle finds what is in it")
      ->delimiter(',')
      ->expected(6);
  app.add_option("--crate", crate,
                 "fault: x,y,z of the centre of a crate that the map does not have, m; it is scanned from the event on")
      ->delimiter(',')
      ->expected(3);
  app.add_option("--crate-edge", o.crate_edge, "m")->capture_default_str();
  app.add_option("--drift", drift, "fault: x,y,z by which a loop closure corrects the VIO at the event, m")
      ->delimiter(',')
      ->expected(3);
  app.add_option("--event-x", o.event_x, "the event: the vehicle has passed this x of the map, m")
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& wrong) {
    return failed(64, std::string(wrong.what()) + "; see backwash-bench --help");
  }
  o.start = {start[0], start[1], start[2]};
  for (const std::string& p : parameters) {
    const auto equals = p.find('=');
    char* end = nullptr;
    const double value = equals == p.npos ? 0 : std::strtod(p.c_str() + equals + 1, &end);
    if (!end || *end != 0 || end == p.c_str() + equals + 1)
      return failed(64, "--parameter " + p + ": expected NAME=NUMBER");
    o.parameters[p.substr(0, equals)] = value;
  }
  if (!crate.empty()) o.crate = backwash::Vec3(crate[0], crate[1], crate[2]);
  if (!hidden.empty())
    o.hidden = {backwash::Vec3(hidden[0], hidden[1], hidden[2]), backwash::Vec3(hidden[3], hidden[4], hidden[5])};
  if (!drift.empty()) o.drift = backwash::Vec3(drift[0], drift[1], drift[2]);
  o.frame.origin = {origin[0], origin[1], origin[2]};
  const auto grid = backwash::map::load_map(o.map);
  if (!grid)
    return failed(grid.error().kind == backwash::map::MapError::Kind::not_found ? 66 : 65, grid.error().message);
  const auto vehicle = backwash::config::load_vehicle(o.vehicle);
  if (!vehicle) return failed(78, vehicle.error().message);
  if (!timeline.empty()) {
    auto loaded = backwash::bench::load_timeline(timeline);
    using Kind = backwash::config::ConfigError::Kind;
    if (!loaded) return failed(loaded.error().kind == Kind::not_found ? 66 : 78, loaded.error().message);
    o.timeline = std::move(*loaded);
  }
  try {
    return backwash::bench::run(o, *grid, *vehicle);
  } catch (const std::exception& e) {
    return failed(70, e.what());
  }
}

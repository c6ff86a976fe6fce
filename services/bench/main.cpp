// SPDX-License-Identifier: BSD-3-Clause
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/config/config.hpp"
#include "core/config/odometry_profile.hpp"
#include "core/map/load_map.hpp"
#include "services/bench/bench.hpp"
#include "services/command_line/command_line.hpp"
#include "services/command_line/exit_code.hpp"
#include "services/command_line/words.hpp"
#include "services/dds/dds.hpp"
#include "services/security/credentials.hpp"
#include "version.hpp"

namespace {

using namespace backwash;
using namespace backwash::services;

int failed(int code, const std::string& message) {
  say_error("backwash-bench", message);
  return code;
}

/// The command line as it is filled.
struct Given {
  bench::Options options;
  std::vector<double> start, origin{12.0, -7.0, 0.3}, crate, drift, hidden;
  std::vector<std::string> parameters;
  std::string timeline;
  bool force = false;
};

void add_world(Command& app, Given& given) {
  app.add_option("--map", given.options.map, "OctoMap file or builtin:NAME").required();
  app.add_option("--vehicle", given.options.vehicle, "vehicle file or builtin:NAME").capture_default_str();
  app.add_option("--start", given.start, "x,y,z above the place where the vehicle stands, m")
      .required()
      .delimiter(',')
      .expected(3);
  const Option link =
      app.add_option("--link", given.options.link, "symbolic link to make to the controller's serial port");
  app.add_option(
         "--in-loop", given.options.in_loop,
         "a real controller, simulated for: tcpin:ADDRESS:PORT (PX4's simulator_mavlink) or a serial port (HITL)")
      .excludes(link);
  app.add_option("--seed", given.options.seed, "of the airflow and of the VIO's drift").capture_default_str();
  app.add_option("--local-yaw", given.options.frame.yaw, "yaw of the controller's own frame, rad")
      .capture_default_str();
  app.add_option("--local-origin", given.origin, "the map's origin in the controller's own frame, m")
      .delimiter(',')
      .expected(3);
  app.add_option("--domain", given.options.domain, "DDS domain").capture_default_str().check(within(0, 230));
  app.add_option("--interface", given.options.interface, "network interface").capture_default_str();
  app.add_option("--namespace", given.options.name_space, "the daemon's name space")
      .capture_default_str()
      .check(name_space());
  app.add_option("--security", given.options.security,
                 "folder of the VIO's credentials, if the daemon has dds.security");
  app.add_option("--duration", given.options.duration_s, "s").capture_default_str().check(positive());
  app.add_option("--log", given.options.log, "flight log of the truth, CSV");
  app.add_option("--wire", given.options.wire, "what arrived from the daemon, frame by frame, CSV");
  app.add_flag("--force", given.force, "overwrite --log and --wire");
}

void add_pace(Command& app, backwash::bench::Pace& pace) {
  app.add_option("--odometry-rate", pace.rate, "of the VIO, Hz").capture_default_str().check(within(1, 1000));
  app.add_option("--odometry-latency", pace.latency, "from a pose to its message, s")
      .capture_default_str()
      .check(within(0, 1));
  app.add_option("--odometry-jitter", pace.jitter, "on top of it, at random up to this, s")
      .capture_default_str()
      .check(within(0, 1));
}

void add_message(Command& app, config::PoseMessage& message) {
  std::vector<std::string> messages;
  for (const auto m : config::kPoseMessages) messages.emplace_back(config::name(m));
  app.add_text(
         "--pose-message",
         [&message](const std::string& name) {
           message = *std::ranges::find(config::kPoseMessages, name, [](auto m) { return config::name(m); });
         },
         "type of the messages that the VIO's poses go out in, as odometry.message has it")
      .check(one_of(messages))
      .default_str("odometry");
}

void add_faults(Command& app, Given& given) {
  app.add_option("--stop-odometry", given.options.stop_odometry_s, "fault: VIO stops this long after arming, s")
      .check(not_negative());
  app.add_option("--stop-heartbeat", given.options.stop_heartbeat_s,
                 "fault: the controller goes silent this long after arming, s")
      .check(not_negative());
  app.add_text(
         "--autopilot",
         [&given](const std::string& name) {
           using enum bench::Options::Profile;
           given.options.autopilot = name == "px4" ? px4 : name == "ardupilot" ? ardupilot : simple;
         },
         "simple, or as measured of a real one: ardupilot, px4")
      .check(one_of({"simple", "ardupilot", "px4"}))
      .default_str("simple");
  app.add_option("--faults", given.timeline,
                 "timeline of faults and of what the flight shall keep, TOML; services/bench/README.md");
  std::vector<std::string> estimators;
  for (const auto& profile : config::odometry_profiles())
    if (!profile.child.empty()) estimators.emplace_back(profile.name);
  app.add_option("--estimator", given.options.estimator, "the odometry as this one fills it, and the map in its frame")
      .check(one_of(estimators));
  add_message(app, given.options.message);
  add_pace(app, given.options.odometry);
  app.add_option("--parameter", given.parameters, "NAME=NUMBER: an autopilot's parameter, in place of its own");
  app.add_option(
         "--hide", given.hidden,
         "x,y,z,x,y,z: corners of a box that the map leaves out, m; a range sensor on the vehicle finds what is in it")
      .delimiter(',')
      .expected(6);
  app.add_option("--crate", given.crate,
                 "fault: x,y,z of the centre of a crate that the map does not have, m; it is scanned from the event on")
      .delimiter(',')
      .expected(3);
  app.add_option("--crate-edge", given.options.crate_edge, "m").capture_default_str().check(positive());
  app.add_option("--drift", given.drift, "fault: x,y,z by which a loop closure corrects the VIO at the event, m")
      .delimiter(',')
      .expected(3);
  app.add_option("--event-x", given.options.event_x, "the event: the vehicle has passed this x of the map, m")
      .capture_default_str();
}

/// NAME=NUMBER; without a value if it is not that.
std::optional<std::pair<std::string, double>> parameter(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == text.npos || equals == 0) return std::nullopt;
  const char* const number = text.c_str() + equals + 1;
  char* end = nullptr;
  const double value = std::strtod(number, &end);
  if (end == number || *end != 0 || !std::isfinite(value)) return std::nullopt;
  return std::pair{text.substr(0, equals), value};
}

/// The vectors of the command line as places.
void set_places(Given& given) {
  bench::Options& o = given.options;
  const auto at = [](const std::vector<double>& v, std::size_t from = 0) {
    return Vec3(v[from], v[from + 1], v[from + 2]);
  };
  o.start = at(given.start);
  o.frame.origin = at(given.origin);
  if (!given.crate.empty()) o.crate = at(given.crate);
  if (!given.drift.empty()) o.drift = at(given.drift);
  if (!given.hidden.empty()) o.hidden = {at(given.hidden), at(given.hidden, 3)};
}

bool missing(map::MapError::Kind kind) {
  return kind == map::MapError::Kind::not_found || kind == map::MapError::Kind::unknown_name;
}

/// Throws StartError 73 for a file that is there and may not be replaced.
void keep(const char* option, const std::string& path, bool force) {
  if (!force && !path.empty() && std::filesystem::is_regular_file(path))
    throw StartError(kCannotCreate,
                     std::string(option) + " " + path + ": exists already; give another name or --force");
}

/// Reads the files that the options name, and runs.
int run(bench::Options& o, const std::string& timeline) {
  if (!o.security.empty())
    if (const auto credentials = security::read_credentials(o.security); !credentials)
      return failed(kConfiguration, "--security: " + credentials.error());
  const auto grid = map::load_map(o.map);
  if (!grid) return failed(missing(grid.error().kind) ? kNoInput : kBadData, grid.error().message);
  const auto vehicle = config::load_vehicle(o.vehicle);
  using Kind = config::ConfigError::Kind;
  if (!vehicle)
    return failed(vehicle.error().kind == Kind::not_found ? kNoInput : kConfiguration, vehicle.error().message);
  if (!timeline.empty()) {
    auto loaded = bench::load_timeline(timeline);
    if (!loaded)
      return failed(loaded.error().kind == Kind::not_found ? kNoInput : kConfiguration, loaded.error().message);
    o.timeline = std::move(*loaded);
  }
  return bench::run(o, *grid, *vehicle);
}

}  // namespace

int main(int argc, char** argv) {
  Command app{
      "backwash-bench: emulated flight controller on a pty, emulated VIO and mapper on DDS, in real time.\n"
      "Example: backwash-bench --map builtin:apartment --start 2,2,1.2 --link /tmp/autopilot",
      "backwash-bench"};
  app.version(kVersion);
  Given given;
  given.options.frame.yaw = 0.6;
  given.options.vehicle = "builtin:quad-5in";
  add_world(app, given);
  add_faults(app, given);
  if (const auto code = app.parse(argc, argv)) return *code;
  if (given.options.link.empty() && given.options.in_loop.empty())
    return failed(kUsage, "--link or --in-loop is needed; see backwash-bench --help");
  for (const std::string& text : given.parameters) {
    const auto named = parameter(text);
    if (!named) return failed(kUsage, "--parameter " + text + ": is not NAME=NUMBER, as in MPC_XY_P=0.9");
    given.options.parameters.insert_or_assign(named->first, named->second);
  }
  set_places(given);
  spdlog::set_default_logger(spdlog::stderr_logger_mt("bench"));  // standard output is for what the timeline expects
  try {
    keep("--log", given.options.log, given.force);
    keep("--wire", given.options.wire, given.force);
    return finished(run(given.options, given.timeline), "backwash-bench");
  } catch (const StartError& e) {
    return failed(e.code, e.what());
  } catch (const dds::NotPermitted& e) {
    return failed(kConfiguration, e.what());
  } catch (const dds::Error& e) {
    return failed(kSystem, std::string(e.what()) + "; give an --interface and a --domain of this machine");
  } catch (const std::exception& e) {
    return failed(kSoftware, e.what());
  }
}

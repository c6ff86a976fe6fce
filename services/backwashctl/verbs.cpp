// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/verbs.hpp"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "services/backwashctl/preflight.hpp"

namespace backwash::ctl {
namespace {

constexpr int kUnavailable = 69;
constexpr std::size_t kMostWaypoints = 64;  // of the IDL's sequence

std::string default_station() {
  char host[64] = "station";
  gethostname(host, sizeof host - 1);
  const char* user = std::getenv("USER");
  return std::string(user ? user : "operator") + "@" + host;
}

nlohmann::json timing(const dds::Timing& t) { return {{"p50", t.p50}, {"p99", t.p99}, {"max", t.max}}; }

nlohmann::json json_of(const StatusCopy& s) {
  const auto& n = s.numbers;
  return {{"vehicle", s.vehicle},
          {"state", s.state},
          {"reason", s.reason},
          {"task", s.task},
          {"armed", static_cast<bool>(n.armed)},
          {"offboard", static_cast<bool>(n.offboard)},
          {"landed", static_cast<bool>(n.landed)},
          {"moving", static_cast<bool>(n.moving)},
          {"frames_aligned", static_cast<bool>(n.frames_aligned)},
          {"position", {n.position.x, n.position.y, n.position.z}},
          {"setpoint", {n.setpoint.x, n.setpoint.y, n.setpoint.z}},
          {"ticks", n.ticks},
          {"ticks_missed", n.ticks_missed},
          {"setpoints_sent", n.setpoints_sent},
          {"samples_inside", n.samples_inside},
          {"samples_outside", n.samples_outside},
          {"odometry_received", n.odometry_received},
          {"odometry_rejected", n.odometry_rejected},
          {"odometry_age_s", n.odometry_age},
          {"maps_accepted", n.maps_accepted},
          {"maps_rejected", n.maps_rejected},
          {"scans_accepted", n.scans_accepted},
          {"scans_rejected", n.scans_rejected},
          {"odometry_refused", n.odometry_refused},
          {"loop_closures", n.loop_closures},
          {"closures_refused", n.closures_refused},
          {"foreign_writers", n.foreign_writers},
          {"map_age_s", n.map_age},
          {"commands_refused", n.commands_refused},
          {"frames_bad", n.frames_bad},
          {"records_lost", n.records_lost},
          {"page_faults", n.page_faults},
          {"frame_residual_m", n.frame_residual_m},
          {"frame_residual_rad", n.frame_residual_rad},
          {"frame_mismatch", s.mismatch},
          {"heartbeat_age_s", n.heartbeat_age},
          {"place", s.place},
          {"parameters", s.parameters},
          {"tick_us", timing(n.tick)},
          {"lateness_us", timing(n.lateness)},
          {"odometry_to_wire_us", timing(n.odometry_to_wire)}};
}

void print(const StatusCopy& s) {
  const auto& n = s.numbers;
  std::printf("%s: %s (%s)  %s %s  at (%.2f, %.2f, %.2f)  inside %llu of %llu  ticks %llu, %llu missed\n",
              s.vehicle.c_str(), s.state.c_str(), s.reason.c_str(), n.armed ? "armed" : "disarmed",
              n.landed ? "on the ground" : (n.moving ? "flying" : "hovering"), n.position.x, n.position.y, n.position.z,
              static_cast<unsigned long long>(n.samples_inside),
              static_cast<unsigned long long>(n.samples_inside + n.samples_outside),
              static_cast<unsigned long long>(n.ticks), static_cast<unsigned long long>(n.ticks_missed));
  std::fflush(stdout);
}

bool tracking(const StatusCopy& s) { return s.state == "tracking"; }

}  // namespace

Verbs::Verbs(CLI::App& app) {
  options_.station = default_station();
  app.require_subcommand(1);
  app.fallthrough();
  app.add_option("--domain", options_.domain, "DDS domain")->capture_default_str()->check(CLI::Range(0, 230));
  app.add_option("--interface", options_.interface, "network interface by name")->capture_default_str();
  app.add_option("--namespace", options_.name_space, "the daemon's name space")->capture_default_str();
  app.add_option("--station", options_.station, "this station's name: it holds the session")->capture_default_str();
  app.add_option("--timeout", options_.timeout_s, "s to wait for an acknowledgement")->capture_default_str();

  const auto verb = [&](const std::string& name, const std::string& what, const std::string& example) {
    auto* sub = app.add_subcommand(name, what);
    sub->footer("Example: backwashctl " + example);
    return sub;
  };
  const auto waiting = [&](CLI::App* sub, double patience_s) {
    sub->add_flag("--wait", wait_, "return when it is done");
    sub->parse_complete_callback([this, patience_s] { patience_s_ = patience_s; });
    return sub;
  };
  waiting(verb("enable", "take control: stream set-points until the autopilot follows", "enable --wait"), 10)
      ->callback([this] {
        chosen_ = [this] {
          return command("enable", backwash_msgs_msg_dds__COMMAND_ENABLE, Vec3::Zero(), tracking, patience_s_);
        };
      });
  verb("disable", "give control back, on the ground", "disable")->callback([this] {
    chosen_ = [this] { return command("disable", backwash_msgs_msg_dds__COMMAND_DISABLE, Vec3::Zero(), {}, 0); };
  });
  auto* takeoff = waiting(
      verb("takeoff", "rise vertically to the lowest clear hover height, or higher", "takeoff --height 1.2 --wait"),
      60);
  takeoff->add_option("--height", height_, "z in the map, m; 0: the lowest clear height")->capture_default_str();
  takeoff->callback([this] {
    chosen_ = [this] {
      return command(
          "takeoff", backwash_msgs_msg_dds__COMMAND_TAKEOFF, {0, 0, height_},
          [](const StatusCopy& s) { return tracking(s) && !s.numbers.landed && !s.numbers.moving; }, patience_s_);
    };
  });
  auto* go = waiting(verb("goto", "plan to a point of the map and fly there", "goto 7.5,2.0,1.2 --wait"), 300);
  go->add_option("goal", goal_, "x,y,z in the map, m")->required()->delimiter(',')->expected(3);
  go->add_option(
      "--yaw", yaw_,
      "heading to turn to at the goal, counter-clockwise from the map's x axis, rad; without: as the path leads there");
  go->callback([this] {
    chosen_ = [this] {
      const Vec3 goal(goal_[0], goal_[1], goal_[2]);
      return command(
          "goto", yaw_ ? backwash_msgs_msg_dds__COMMAND_GOTO_FACING : backwash_msgs_msg_dds__COMMAND_GOTO, goal,
          [goal](const StatusCopy& s) {
            const auto& p = s.numbers.setpoint;
            return tracking(s) && !s.numbers.moving && (Vec3(p.x, p.y, p.z) - goal).norm() < 0.01;
          },
          patience_s_);
    };
  });
  waiting(verb("hold", "slow down on the path and hover", "hold --wait"), 20)->callback([this] {
    chosen_ = [this] {
      return command(
          "hold", backwash_msgs_msg_dds__COMMAND_HOLD, Vec3::Zero(),
          [](const StatusCopy& s) { return tracking(s) && !s.numbers.moving; }, patience_s_);
    };
  });
  auto* follow_verb = waiting(
      verb(
          "follow",
          "fly to each point of a CSV in turn (columns x_m,y_m,z_m), at rest at each; each leg is planned and verified",
          "follow route.csv --wait"),
      900);
  follow_verb->add_option("file", route_, "points CSV: x_m,y_m,z_m, at most 64 rows")->required();
  follow_verb->callback([this] { chosen_ = [this] { return follow(); }; });
  waiting(verb("stop", "brake at once on the next verified stop and stay; on the ground, disarmed, the same as disable",
               "stop --wait"),
          20)
      ->callback([this] {
        chosen_ = [this] {
          return command(
              "stop", backwash_msgs_msg_dds__COMMAND_STOP, Vec3::Zero(),
              [](const StatusCopy& s) { return s.state == "passive" || (s.state == "hold" && !s.numbers.moving); },
              patience_s_);
        };
      });
  waiting(verb("land", "land below, with the autopilot's own landing", "land --wait"), 60)->callback([this] {
    chosen_ = [this] {
      return command(
          "land", backwash_msgs_msg_dds__COMMAND_LAND, Vec3::Zero(),
          [](const StatusCopy& s) { return s.state == "passive" && !s.numbers.armed; }, patience_s_);
    };
  });
  verb("release", "end this station's session", "release")->callback([this] {
    chosen_ = [this] { return command("release", backwash_msgs_msg_dds__COMMAND_RELEASE, Vec3::Zero(), {}, 0); };
  });
  auto* check_verb =
      verb("check", "preflight: 0 when all is good, 69 otherwise; each failing line says what to do", "check");
  check_verb->add_flag("--json", json_, "one JSON object");
  check_verb->callback([this] { chosen_ = [this] { return check(); }; });
  auto* now = verb("status", "print the daemon's status once", "status --json");
  now->add_flag("--json", json_, "one JSON object");
  now->callback([this] { chosen_ = [this] { return status(); }; });
  verb("watch", "print the status until interrupted", "watch")->callback([this] {
    chosen_ = [this] { return watch(); };
  });
}

int Verbs::run() { return chosen_(); }

int Verbs::command(const std::string& name, std::uint8_t verb, const Vec3& position,
                   const std::function<bool(const StatusCopy&)>& done, double patience_s) {
  Station station(options_);
  const auto fail = [&](const std::string& why) {
    std::cerr << "backwashctl " << name << ": " << why << "\n";
    return kUnavailable;
  };
  const auto answer = station.send(verb, position, yaw_.value_or(0), waypoints_);
  if (!answer)
    return fail("no daemon answered in domain " + std::to_string(options_.domain) + " on interface " +
                options_.interface + ", namespace " + options_.name_space + "; is backwashd running?");
  if (answer->result != backwash_msgs_msg_dds__ACK_ACCEPTED) return fail("refused: " + answer->reason);
  if (!wait_ || !done) return 0;
  // The first status after the acknowledgement may still be from before it.
  station.status(1.0);
  station.status(1.0);
  std::string last = "no status";
  const bool reached = station.wait(patience_s, done, [&](const StatusCopy& s) {
    last = s.state + " (" + s.reason + ")" + (s.task.empty() ? "" : ", " + s.task);
    if (s.task.starts_with("refused")) return true;
    const bool lost = s.state == "quiet" || s.state == "hold" || (s.state == "passive" && name != "land");
    return lost && name != "hold" && name != "stop";
  });
  return reached ? 0 : fail("not reached; the daemon is " + last);
}

int Verbs::status() {
  Station station(options_);
  const auto now = station.status(options_.timeout_s);
  if (!now) {
    std::cerr << "backwashctl status: no daemon in domain " << options_.domain << " on interface "
              << options_.interface << ", namespace " << options_.name_space << "; is backwashd running?\n";
    return kUnavailable;
  }
  if (json_)
    std::cout << json_of(*now).dump(2) << "\n";
  else
    print(*now);
  return 0;
}

// The file is the points CSV of the other programs.
int Verbs::follow() {
  std::ifstream file(route_);
  std::string line;
  const auto fail = [&](int code, const std::string& where, const std::string& why) {
    std::cerr << "backwashctl follow: " << where << ": " << why << "\n";
    return code;
  };
  if (!std::getline(file, line)) return fail(66, route_, "cannot be read");
  if (line != "x_m,y_m,z_m") return fail(65, route_ + ":1", "the first line is '" + line + "', expected x_m,y_m,z_m");
  for (int number = 2; std::getline(file, line); ++number) {
    Vec3 p;
    char rest;
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf %c", &p.x(), &p.y(), &p.z(), &rest) != 3 || !p.allFinite())
      return fail(65, route_ + ":" + std::to_string(number), "'" + line + "' is not three numbers");
    waypoints_.push_back(p);
  }
  if (waypoints_.empty() || waypoints_.size() > kMostWaypoints)
    return fail(65, route_, std::to_string(waypoints_.size()) + " points, expected 1 to 64");
  const Vec3 goal = waypoints_.back();
  return command(
      "follow", backwash_msgs_msg_dds__COMMAND_FOLLOW, Vec3::Zero(),
      [goal](const StatusCopy& s) {
        const auto& p = s.numbers.setpoint;
        return tracking(s) && !s.numbers.moving && (Vec3(p.x, p.y, p.z) - goal).norm() < 0.01;
      },
      patience_s_);
}

int Verbs::check() {
  constexpr double kWatch = 2.0;  // s
  Station station(options_);
  const auto before = station.status(options_.timeout_s);
  auto after = before;
  const auto begun = std::chrono::steady_clock::now();
  const auto since = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count(); };
  while (after && since() < kWatch) after = station.status(1.0);
  if (!after) {
    std::cerr << "backwashctl check: no daemon in domain " << options_.domain << " on interface "
              << options_.interface << ", namespace " << options_.name_space << "; is backwashd running?\n";
    return kUnavailable;
  }
  bool all = true;
  nlohmann::json lines = nlohmann::json::array();
  for (const Finding& f : preflight(*before, *after, since())) {
    all = all && f.good;
    lines.push_back({{"name", f.name}, {"good", f.good}, {"found", f.found}, {"advice", f.advice}});
    if (!json_)
      std::cout << (f.good ? "good  " : "FAIL  ") << f.name << ": " << f.found << (f.good ? "" : " -> " + f.advice)
                << "\n";
  }
  if (json_) std::cout << nlohmann::json{{"good", all}, {"findings", lines}}.dump(2) << "\n";
  return all ? 0 : kUnavailable;
}

int Verbs::watch() {
  Station station(options_);
  for (;;) {
    if (const auto now = station.status(2.0))
      print(*now);
    else
      std::cerr << "no status for 2 s\n";
  }
}

}  // namespace backwash::ctl

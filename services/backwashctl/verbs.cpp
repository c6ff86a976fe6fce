// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/verbs.hpp"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/config/route_file.hpp"
#include "services/backwashctl/answer.hpp"
#include "services/backwashctl/preflight.hpp"
#include "services/backwashctl/status_output.hpp"
#include "services/command_line/exit_code.hpp"
#include "services/command_line/words.hpp"
#include "services/dds/air_text.hpp"

namespace backwash::ctl {
namespace {

std::string default_station() {
  char host[64] = "station";
  gethostname(host, sizeof host - 1);
  const char* user = std::getenv("USER");
  return std::string(user ? user : "operator") + "@" + host;
}

constexpr std::string_view kNotToldYet = "no value of ";  // how such a refusal begins

bool tracking(const StatusCopy& s) { return s.in(Mode::tracking); }
bool rests(const StatusCopy& s) { return tracking(s) && !s.said.moving; }
/// A task that is not done counts: a route may pass its last place on the way, and a turn begins where it ends.
std::function<bool(const StatusCopy&)> rests_at(const Vec3& goal) {
  return [goal](const StatusCopy& s) {
    const auto& p = s.said.setpoint;
    return rests(s) && s.text(&dds::Status::task).empty() && (Vec3(p.x, p.y, p.z) - goal).norm() < 0.01;
  };
}

/// The measured height counts: a set-point is there before the vehicle is.
bool risen(const StatusCopy& s) {
  constexpr double kNear = 0.1;  // m
  return rests(s) && !s.said.landed && s.text(&dds::Status::task).empty() &&
         std::abs(s.said.position.z - s.said.setpoint.z) < kNear;
}

}  // namespace

Verbs::Verbs(Command& app) {
  options_.station = default_station();
  app.require_subcommand();
  app.fallthrough();
  app.add_option("--domain", options_.domain, "DDS domain").capture_default_str().check(services::within(0, 230));
  app.add_option("--interface", options_.interface, "network interface by name").capture_default_str();
  app.add_option("--namespace", options_.name_space, "the daemon's name space")
      .capture_default_str()
      .check(services::name_space());
  app.add_option("--station", options_.station, "this station's name: it holds the session").capture_default_str();
  app.add_option("--security", options_.security,
                 "folder of this station's credentials, if the daemon has dds.security");
  app.add_option("--timeout", options_.timeout_s, "s to wait for an acknowledgement")
      .capture_default_str()
      .check(services::positive());
  app.add_flag("--json", json_, "one JSON object on stdout");
  add_control(app);
  add_ways(app);
  add_goals(app);
  add_ends(app);
  add_views(app);
  add_adaptation(app);
  add_map(app);
}

Command* Verbs::verb(Command& app, const std::string& name, const std::string& what, const std::string& example,
                     std::function<int()> run) {
  auto& sub = app.add_subcommand(name, what);
  sub.footer("Example: backwashctl " + example);
  sub.on_parsed([this, run = std::move(run)] { chosen_ = run; });
  return &sub;
}

Command* Verbs::waiting(Command* sub, double patience_s) {
  sub->add_flag("--wait", wait_, "return when it is done");
  sub->on_complete([this, patience_s] { patience_s_ = patience_s; });
  return sub;
}

void Verbs::add_control(Command& app) {
  waiting(
      verb(app, "enable", "take control: stream set-points until the autopilot follows, and would arm", "enable --wait",
           [this] {
             return command("enable", backwash_msgs_msg_dds__COMMAND_ENABLE, Vec3::Zero(),
                            [](const StatusCopy& s) { return tracking(s) && !s.advises(dds::kArming); });
           }),
      10);
  verb(app, "disable", "give control back, on the ground", "disable",
       [this] { return command("disable", backwash_msgs_msg_dds__COMMAND_DISABLE, Vec3::Zero(), {}); });
  verb(app, "release", "end this station's session", "release",
       [this] { return command("release", backwash_msgs_msg_dds__COMMAND_RELEASE, Vec3::Zero(), {}); });
}

void Verbs::add_ways(Command& app) {
  auto* takeoff = waiting(
      verb(app, "takeoff", "rise vertically to the lowest clear hover height, or higher", "takeoff --height 1.2 --wait",
           [this] {
             return command("takeoff", backwash_msgs_msg_dds__COMMAND_TAKEOFF, {0, 0, height_}, risen);
           }),
      60);
  takeoff->add_option("--height", height_, "z in the map, m; 0: the lowest clear height").capture_default_str();
  auto* go = waiting(verb(app, "goto", "plan to a point of the map and fly there", "goto 7.5,2.0,1.2 --wait",
                          [this] { return go_to(); }),
                     300);
  go->add_option("goal", goal_, "x,y,z in the map, m").required().delimiter(',').expected(3);
  go->add_option("--yaw", yaw_,
                 "heading to turn to at the goal, counter-clockwise from the map's x axis, rad; without: as the path "
                 "leads there");
  auto* follow_verb = waiting(verb(app, "follow",
                                   "fly to each point of a CSV in turn (columns x_m,y_m,z_m; yaw_rad: a heading to "
                                   "turn to there), at rest at each; "
                                   "each leg is planned and verified",
                                   "follow route.csv --wait", [this] { return follow(); }),
                              900);
  follow_verb->add_option("file", route_, "points CSV: x_m,y_m,z_m, at most 64 rows; with yaw_rad at most 32")
      .required();
}

void Verbs::add_goals(Command& app) {
  auto* goals_verb =
      verb(app, "goals", "fly to each goal of a ROS 2 topic until interrupted: what RViz's \"2D Goal Pose\" sends",
           "goals --height 1.2", [this] { return goals(); });
  goals_verb->add_option("--topic", goal_topic_, "of geometry_msgs/PoseStamped")
      .capture_default_str()
      .check(services::topic());
  goals_verb->add_option("--frame", goal_rules_.frame, "that goals are in: the daemon's frames.map")
      .capture_default_str();
  goals_verb->add_option("--height", goal_rules_.height, "z of every goal in the map, m; without: each has its own");
  goals_verb->add_option("--heading", heading_, "goal: turn to the goal's own; path: as the path leads there")
      .capture_default_str()
      .check(services::one_of({"goal", "path"}));
}

void Verbs::add_ends(Command& app) {
  waiting(verb(app, "hold", "slow down on the path and hover", "hold --wait",
               [this] { return command("hold", backwash_msgs_msg_dds__COMMAND_HOLD, Vec3::Zero(), rests); }),
          20);
  waiting(verb(app, "stop",
               "brake at once on the next verified stop and stay; on the ground, disarmed, the same as disable",
               "stop --wait",
               [this] {
                 return command("stop", backwash_msgs_msg_dds__COMMAND_STOP, Vec3::Zero(), [](const StatusCopy& s) {
                   return s.in(Mode::passive) || (s.in(Mode::hold) && !s.said.moving);
                 });
               }),
          20);
  waiting(verb(app, "land", "land below, with the autopilot's own landing", "land --wait",
               [this] {
                 return command("land", backwash_msgs_msg_dds__COMMAND_LAND, Vec3::Zero(),
                                [](const StatusCopy& s) { return s.in(Mode::passive) && !s.said.armed; });
               }),
          60);
}

void Verbs::add_views(Command& app) {
  verb(app, "check", "preflight: 0 when all is good, 69 otherwise; each failing line says what to do", "check",
       [this] { return check(); });
  verb(app, "status", "print the daemon's status once", "status --json", [this] { return status(); });
  verb(app, "watch", "print the status until interrupted; with --json an object a line", "watch",
       [this] { return watch(); });
  auto* page = verb(app, "serve", "show the flight on a page in a browser, with buttons, until interrupted", "serve",
                    [this] { return serve(options_, page_, json_); });
  add_options(*page, page_);
}

int Verbs::run() { return chosen_(); }

/// Why there may be no answer.
std::string Verbs::nobody() const {
  return "no daemon answered in domain " + std::to_string(options_.domain) + " on interface " + options_.interface +
         ", namespace " + options_.name_space + "; is backwashd running, " +
         (options_.security.empty() ? "without dds.security?" : "with credentials of the same authority?");
}

int Verbs::command(const std::string& name, std::uint8_t verb, const Vec3& position,
                   const std::function<bool(const StatusCopy&)>& done) {
  Station station(options_);
  Outcome outcome{name, false, std::nullopt, ""};
  const auto fail = [&](const std::string& why) {
    outcome.why = why;
    if (outcome.accepted && wait_) outcome.done = false;
    return say(outcome, json_);
  };
  const auto send = [&] { return station.send(verb, position, yaw_.value_or(0), waypoints_); };
  auto answer = send();
  // What the autopilot has not told yet is waited for too.
  const auto given_up = std::chrono::steady_clock::now() + std::chrono::duration<double>(patience_s_);
  while (wait_ && answer && answer->reason.starts_with(kNotToldYet) && !interrupted() &&
         std::chrono::steady_clock::now() < given_up) {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    answer = send();
  }
  if (interrupted()) return fail("interrupted");
  if (!answer) return fail(nobody());
  if (answer->result != backwash_msgs_msg_dds__ACK_ACCEPTED) return fail("refused: " + answer->reason);
  outcome.accepted = true;
  if (!wait_ || !done) return say(outcome, json_);
  // The first status after the acknowledgement may still be from before it.
  station.status(1.0);
  station.status(1.0);
  std::string last = "no status";
  bool superseded = false, set_out = false;
  const bool reached = station.wait(patience_s_, done, [&](const StatusCopy& s) {
    last = s.text(&dds::Status::state) + " (" + s.text(&dds::Status::reason) + ")" +
           (s.text(&dds::Status::task).empty() ? "" : ", " + s.text(&dds::Status::task)) +
           (s.text(&dds::Status::autopilot_says).empty()
                ? ""
                : "; the autopilot says: " + s.text(&dds::Status::autopilot_says));
    superseded = station.superseded(s);
    if (superseded || s.text(&dds::Status::task).starts_with(kRefusedTask)) return true;
    // On its way to a goal it goes on by itself after an obstacle. A hold that was there before is not its end.
    const bool on_its_way =
        verb == backwash_msgs_msg_dds__COMMAND_GOTO || verb == backwash_msgs_msg_dds__COMMAND_GOTO_FACING ||
        verb == backwash_msgs_msg_dds__COMMAND_FOLLOW || verb == backwash_msgs_msg_dds__COMMAND_FOLLOW_FACING;
    set_out = set_out || !s.in(Mode::hold);
    const bool held = set_out && s.in(Mode::hold) && !(on_its_way && s.because(Reason::obstacle_ahead));
    const bool lost = s.in(Mode::quiet) || held || (s.in(Mode::passive) && verb != backwash_msgs_msg_dds__COMMAND_LAND);
    return lost && verb != backwash_msgs_msg_dds__COMMAND_HOLD && verb != backwash_msgs_msg_dds__COMMAND_STOP;
  });
  if (interrupted()) return fail("interrupted; the session is over, the daemon is " + last);
  if (superseded) return fail("a later command took its place; the daemon is " + last);
  if (!reached) return fail("not reached; the daemon is " + last);
  outcome.done = true;
  return say(outcome, json_);
}

int Verbs::status() {
  Station station(options_);
  const auto now = station.status(options_.timeout_s);
  if (!now) {
    std::cerr << "backwashctl status: " << nobody() << "\n";
    return kUnavailable;
  }
  if (json_)
    std::cout << text_of(json_of(*now), 2) << "\n";
  else
    print(*now);
  return 0;
}

int Verbs::go_to() {
  const Vec3 goal(goal_[0], goal_[1], goal_[2]);
  return command("goto", yaw_ ? backwash_msgs_msg_dds__COMMAND_GOTO_FACING : backwash_msgs_msg_dds__COMMAND_GOTO, goal,
                 rests_at(goal));
}

int Verbs::follow() {
  const auto route = config::read_route(route_);
  if (!route) {
    services::say_error("backwashctl follow", route.error().message);
    return route.error().kind == config::ConfigError::Kind::not_found ? kNoInput : kBadData;
  }
  waypoints_ = config::waypoints_of(*route);
  const auto verb = config::has_headings(*route) ? backwash_msgs_msg_dds__COMMAND_FOLLOW_FACING
                                                 : backwash_msgs_msg_dds__COMMAND_FOLLOW;
  return command("follow", verb, Vec3::Zero(), rests_at(route->back().p_W));
}

int Verbs::goals() {
  Station station(options_, {"rt" + goal_topic_});
  goal_rules_.facing = heading_ == "goal";
  return serve_goals(station, "rt" + goal_topic_, goal_rules_, json_);
}

int Verbs::watch() {
  Station station(options_);
  while (!interrupted()) {
    const auto now = station.status(2.0);
    if (now && json_)
      std::cout << text_of(json_of(*now), -1) << std::endl;
    else if (now)
      print(*now);
    else if (!interrupted())
      std::cerr << "no status for 2 s\n";
  }
  return 0;
}

int Verbs::check() {
  constexpr double kWatch = 2.0, kAsked = 15.0;  // s
  Station station(options_);
  const auto before = station.status(options_.timeout_s);
  auto after = before;
  const auto begun = std::chrono::steady_clock::now();
  const auto since = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count(); };
  // What an autopilot has, and what it has not, takes longer to ask for than rates to count.
  while (after && !interrupted() && since() < (after->advises(dds::kAsking) ? kAsked : kWatch))
    after = station.status(1.0);
  if (!after) {
    std::cerr << "backwashctl check: " << nobody() << "\n";
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
  if (json_) std::cout << text_of({{"good", all}, {"findings", lines}}, 2) << "\n";
  return all ? 0 : kUnavailable;
}

void Verbs::add_adaptation(Command& app) {
  auto* sub = verb(app, "adaptation", "what was learnt of the air: factor by class, its evidence and time of flight",
                   "adaptation --json", [this] { return adaptation(); });
  sub->add_option("what", air_order_,
                  "show; freeze: the factors stay as they are; thaw: they follow the evidence again, also that of "
                  "meanwhile; reset: nothing counts any more, only disarmed and not enabled")
      .capture_default_str()
      .check(services::one_of({"show", "freeze", "thaw", "reset"}));
}

int Verbs::adaptation() {
  const auto ask = [this](std::uint8_t verb) { return command("adaptation " + air_order_, verb, Vec3::Zero(), {}); };
  if (air_order_ == "reset") return ask(backwash_msgs_msg_dds__COMMAND_AIR_RESET);
  if (air_order_ == "freeze") return ask(backwash_msgs_msg_dds__COMMAND_AIR_FREEZE);
  if (air_order_ == "thaw") return ask(backwash_msgs_msg_dds__COMMAND_AIR_THAW);
  Station station(options_);
  const auto now = station.status(options_.timeout_s);
  if (!now) return services::say_error("backwashctl adaptation", nobody()), kUnavailable;
  const auto air = dds::air_said(now->text(&dds::Status::air));
  if (!air && !now->text(&dds::Status::air).empty())
    return services::say_error("backwashctl adaptation",
                               "the daemon is of another version: it says '" + now->text(&dds::Status::air) + "'"),
           kUnavailable;
  if (json_)
    std::cout << json_of(air).dump(2) << "\n";
  else
    print(air);
  return kOk;
}

void Verbs::add_map(Command& app) {
  auto* sub = verb(app, "map", "send a map and wait until the daemon has it in use; on a bad line too",
                   "map floor.bt --patience 60", [this] { return map(); });
  sub->add_option("file", map_.file, "OctoMap, or builtin:NAME").required();
  sub->add_option("--frame", map_.frame, "that the map is in: the daemon's frames.map").capture_default_str();
  sub->add_option("--rate", map_.rate_kbit_s, "kbit/s that the line carries; slower lines are noticed")
      .capture_default_str()
      .check(services::within(64, 1e6));
  sub->add_option("--patience", map_.patience_s, "s without a newly acknowledged part until it is given up")
      .capture_default_str()
      .check(services::positive());
}

int Verbs::map() {
  try {
    return say(send_map(options_, map_, json_), json_);
  } catch (const dds::NotPermitted& e) {
    return say({"map", false, std::nullopt, std::string("refused: ") + e.what()}, json_);
  }
}

}  // namespace backwash::ctl

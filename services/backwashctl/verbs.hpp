// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "services/backwashctl/goals.hpp"
#include "services/backwashctl/map.hpp"
#include "services/backwashctl/serve/serve.hpp"
#include "services/backwashctl/station.hpp"
#include "services/command_line/command_line.hpp"

namespace backwash::ctl {

using services::Command;

/// The verbs of backwashctl: enable, disable, takeoff, goto, follow, hold, stop, land, release, goals, status, watch,
/// check, serve, adaptation, map.
class Verbs {
 public:
  explicit Verbs(Command& app);
  /// Runs the chosen verb. 0: done (with --wait: reached); 69: refused, lost or not reached, with one line on stderr.
  int run();

 private:
  void add_control(Command& app);
  void add_ways(Command& app);
  void add_goals(Command& app);
  void add_ends(Command& app);
  void add_views(Command& app);
  void add_adaptation(Command& app);
  void add_map(Command& app);
  Command* verb(Command& app, const std::string& name, const std::string& what, const std::string& example,
                std::function<int()> run);
  Command* waiting(Command* sub, double patience_s);
  int command(const std::string& name, std::uint8_t verb, const Vec3& position,
              const std::function<bool(const StatusCopy&)>& done);
  std::string nobody() const;
  int go_to();
  int follow();
  int goals();
  int status();
  int check();
  int watch();
  int adaptation();
  int map();

  Options options_;
  std::vector<double> goal_;
  std::optional<double> yaw_;
  std::vector<Vec3> waypoints_;  ///< of the command: of a route with headings pairs
  std::string route_;
  GoalRules goal_rules_;
  ServeOptions page_;
  MapOptions map_;
  std::string goal_topic_ = "/goal_pose", heading_ = "goal", air_order_ = "show";
  double height_ = 0, patience_s_ = 0;
  bool wait_ = false, json_ = false;
  std::function<int()> chosen_;
};

}  // namespace backwash::ctl

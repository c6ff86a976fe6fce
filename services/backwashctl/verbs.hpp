// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "services/backwashctl/station.hpp"

namespace backwash::ctl {

/// The verbs of backwashctl: enable, disable, takeoff, goto, follow, hold, stop, land, release, status, watch, check.
class Verbs {
 public:
  explicit Verbs(CLI::App& app);
  /// Runs the chosen verb. 0: done (with --wait: reached); 69: refused, lost or not reached, with one line on stderr.
  int run();

 private:
  void add_control(CLI::App& app);
  void add_ways(CLI::App& app);
  void add_ends(CLI::App& app);
  void add_views(CLI::App& app);
  CLI::App* verb(CLI::App& app, const std::string& name, const std::string& what, const std::string& example,
                 std::function<int()> run);
  CLI::App* waiting(CLI::App* sub, double patience_s);
  int command(const std::string& name, std::uint8_t verb, const Vec3& position,
              const std::function<bool(const StatusCopy&)>& done);
  int go_to();
  int follow();
  int status();
  int check();
  int watch();

  Options options_;
  std::vector<double> goal_;
  std::optional<double> yaw_;
  std::vector<Vec3> waypoints_;
  std::string route_;
  double height_ = 0, patience_s_ = 0;
  bool wait_ = false, json_ = false;
  std::function<int()> chosen_;
};

}  // namespace backwash::ctl

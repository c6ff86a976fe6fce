// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/plan/vehicle_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "core/config/builtin_files.hpp"
#include "core/types/angle.hpp"
#include "core/types/geometry.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"

namespace backwash::services {
namespace {

struct VehicleFileOptions {
  std::string name, kind = "vehicle", vehicle;
  bool json = false;
};

constexpr double kLittleThrust = 1.5;  // over the weight: below, hardly any is left to hold a gust off and climb
constexpr double kLittleDamping = 0.5;

int print_file(const VehicleFileOptions& options) {
  constexpr std::string_view kPrefix = "builtin:";
  const auto found = std::ranges::find(
      config::builtin_files(),
      options.name.substr(std::min(options.name.size(), kPrefix.size())) + "." + options.kind + ".toml",
      &config::BuiltinFile::name);
  if (!options.name.starts_with(kPrefix) || found == config::builtin_files().end())
    throw Failure(kNoInput, options.name + ": no built-in " + options.kind +
                                "; give builtin:quad-5in or builtin:quad-7in, or builtin:backwashd with --kind daemon");
  std::printf("%.*s", static_cast<int>(found->text.size()), found->text.data());
  return kOk;
}

double damping(double kp, double kd) { return kd / (2 * std::sqrt(kp)); }

int check_file(const VehicleFileOptions& options) {
  const auto v = read_vehicle(options.vehicle);
  const auto reach = read_reachability(v, reach::Method::tight, reach::Loop::vehicle, options.vehicle);
  const double thrust = v.propulsion.max_thrust / (v.body.mass * kGravity);
  const auto &kp = v.controller.kp, &kd = v.controller.kd;
  const double along = damping(kp.horizontal, kd.horizontal), up = damping(kp.vertical, kd.vertical);
  const double lean = std::atan(std::numbers::sqrt2 * v.limits.a_max / kGravity);
  Json notes = Json::array();
  if (thrust < kLittleThrust)
    notes.push_back("propulsion.max_thrust is less than 1.5 times the weight: weigh it, battery in, and look again");
  if (std::min(along, up) < kLittleDamping)
    notes.push_back(
        "the loop swings (damping below 0.5): are controller.kp and kd in 1/s² and 1/s, not the autopilot's?");
  if (v.estimation.position == 0)
    notes.push_back("estimation.position is 0: no VIO and no map is that good; measure it");
  const Json json = {
      {"name", v.name},
      {"thrust_over_weight", thrust},
      {"hover_command", hover_command(v)},
      {"lean_rad", lean},
      {"kp", {{"horizontal", kp.horizontal}, {"vertical", kp.vertical}}},
      {"kd", {{"horizontal", kd.horizontal}, {"vertical", kd.vertical}}},
      {"damping", {{"horizontal", along}, {"vertical", up}}},
      {"half_width_per_mps2", {{"horizontal", reach.horizontal.h_inf}, {"vertical", reach.vertical.h_inf}}},
      {"notes", notes}};
  if (options.json) {
    print(json);
    return kOk;
  }
  std::printf("%-22s %s\n", "vehicle", v.name.c_str());
  std::printf("%-22s %.2f; hovers at a thrust command of %.2f\n", "thrust over weight", thrust,
              json["hover_command"].get<double>());
  std::printf("%-22s %.0f degrees at limits.a_max along x and y\n", "lean", lean / kDegree);
  std::printf("%-22s k_p %.3g, k_d %.3g, damping %.2f; vertical %.3g, %.3g, %.2f\n", "loop", kp.horizontal,
              kd.horizontal, along, kp.vertical, kd.vertical, up);
  std::printf("%-22s %.3f m for each m/s² of disturbance; vertical %.3f m\n", "hover set, half width",
              reach.horizontal.h_inf, reach.vertical.h_inf);
  for (const auto& note : notes) std::printf("%-22s %s\n", "look at", note.get<std::string>().c_str());
  return kOk;
}

}  // namespace

double hover_command(const Vehicle& v) {
  const double f = v.propulsion.thr_mdl_fac, share = v.body.mass * kGravity / v.propulsion.max_thrust;
  return f < 1e-9 ? share : (std::sqrt((1 - f) * (1 - f) + 4 * f * share) - (1 - f)) / (2 * f);
}

Verb vehicle_print_verb(Command& group) {
  const auto options = std::make_shared<VehicleFileOptions>();
  auto& command = group.add_subcommand("print", "A file that ships, to begin your own with");
  command.add_option("name", options->name, "builtin:quad-5in, builtin:quad-7in; builtin:backwashd with --kind daemon")
      .required();
  command.add_option("--kind", options->kind, "which of its files")
      .check(one_of({"vehicle", "model", "daemon"}))
      .capture_default_str();
  command.footer("Example:\n  backwash vehicle print builtin:quad-5in");
  return {&command, [options] { return print_file(*options); }};
}

Verb vehicle_check_verb(Command& group) {
  const auto options = std::make_shared<VehicleFileOptions>();
  auto& command = group.add_subcommand("check", "Whether a vehicle file is good, and what follows from it");
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME").required();
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.footer("Example:\n  backwash vehicle check --vehicle builtin:quad-5in");
  return {&command, [options] { return check_file(*options); }};
}

}  // namespace backwash::services

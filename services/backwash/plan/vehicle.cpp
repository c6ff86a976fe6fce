// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <sstream>

#include "core/files/read_file.hpp"
#include "core/log/raw/raw_log.hpp"
#include "core/plan/world/gain_sweep.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/plan/firmware_gains.hpp"
#include "services/backwash/plan/logged_vehicle.hpp"
#include "services/backwash/plan/vehicle_file.hpp"
#include "services/backwash/plan/vehicle_fit.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

struct VehicleOptions {
  std::string map, model, vehicle, parameters, log;
  std::optional<Vec3> start, goal;
  bool json = false;
};

using firmware_bridge::Ask;

/// NAME and number of each line of a parameter file: ArduPilot's (NAME,1 or NAME 1), PX4's (NAME=1), or a ground
/// station's with NAME and value in the third and fourth column.
std::map<std::string, double> read_parameters(const std::string& path) {
  const auto text = files::read_file(path, files::kLargestConfiguration, "the autopilot's parameter file");
  if (!text) throw Failure(kNoInput, path + ":1: " + text.error().message);
  std::istringstream file(*text);
  std::map<std::string, double> values;
  for (std::string line; std::getline(file, line);) {
    for (char& c : line)
      if (c == '=' || c == ',' || c == '\t' || c == '\r') c = ' ';
    std::istringstream words(line);
    std::string name, before;
    for (int n = 0; n < 3 && words >> name && std::isdigit(static_cast<unsigned char>(name[0])); ++n) before = name;
    double value = 0;
    if (!name.empty() && name[0] != '#' && words >> value) values[name] = value;
  }
  return values;
}

/// Samples of a flight with the present gains, and how many of them lay in their set.
struct TuningEvidence {
  std::size_t judged = 0, inside = 0;
};

TuningEvidence evidence_of(const std::string& path) {
  const auto log = read_or_fail(log::read_raw_log(path));
  TuningEvidence evidence;
  for (const auto& record : log.records) {
    log::TickRecord tick;
    if (record.header.kind != log::RecordKind::tick || record.bytes.size() < sizeof tick) continue;
    std::memcpy(&tick, record.bytes.data(), sizeof tick);
    evidence.judged += tick.judged != 0;
    evidence.inside += tick.judged != 0 && tick.inside != 0;
  }
  if (evidence.judged == 0)
    throw Failure(kBadData, path + ":1: no sample of it was judged against a set; give a log of a flight");
  return evidence;
}

std::array<double, 4> firmware_gains(const plan::GainStep& s) {
  return {s.kp.horizontal / s.kd.horizontal, s.kd.horizontal, s.kp.vertical / s.kd.vertical, s.kd.vertical};
}

Json to_json(const plan::GainStep& s) {
  Json json = {{"factor", s.factor},
               {"kp", {{"horizontal", s.kp.horizontal}, {"vertical", s.kp.vertical}}},
               {"kd", {{"horizontal", s.kd.horizontal}, {"vertical", s.kd.vertical}}},
               {"stable", s.stable},
               {"passable", s.passable()}};
  json["tightest"] = nullptr;
  if (s.way)
    json["tightest"] = {{"p", services::to_json(s.way->place_W)},
                        {"free_distance_m", s.way->free_distance_m},
                        {"bounded", s.set.bounded},
                        {"half_widths_m", s.set.bounded ? Json(s.set.half_widths) : Json()},
                        {"clearance_m", s.set.bounded ? Json(s.set.clearance) : Json()}};
  return json;
}

void print_text(const plan::GainSweep& sweep, const Firmware& firmware, const Vehicle& vehicle,
                const std::optional<TuningEvidence>& evidence) {
  const std::string names[] = {firmware.name(Ask::k_p_horizontal), firmware.name(Ask::k_d_horizontal),
                               firmware.name(Ask::k_p_vertical), firmware.name(Ask::k_d_vertical)};
  const auto& integral = vehicle.controller.velocity_integrator;
  if (integral.horizontal > 0)
    std::printf("integral gains of the velocity, which stay: %g along x and y, %g along z\n", integral.horizontal,
                integral.vertical);
  if (!firmware.left_out.empty()) std::printf("%s\n", firmware.left_out.c_str());
  if (evidence)
    std::printf(
        "the log: %zu of %zu samples inside the sets of the gains it was flown with%s\n", evidence->inside,
        evidence->judged,
        evidence->inside == evidence->judged ? "" : "; calibrate the model first: the sets below are too small");
  std::printf("%7s %8s %8s %8s %8s  tightest place of the way\n", "factor", names[0].c_str(), names[1].c_str(),
              names[2].c_str(), names[3].c_str());
  for (const auto& s : sweep.steps) {
    const auto g = firmware_gains(s);
    std::printf("%7.2f %8.3g %8.3g %8.3g %8.3g  ", s.factor, g[0], g[1], g[2], g[3]);
    if (!s.stable)
      std::printf("the loop is unstable with this delay and lag\n");
    else if (!s.way)
      std::printf("no way through free voxels\n");
    else if (!s.set.bounded)
      std::printf("%s: the set grows without bound\n", to_text(s.way->place_W).c_str());
    else
      std::printf("%s: set ±%.3f, %.3f, %.3f m, %.3f m to spare%s\n", to_text(s.way->place_W).c_str(),
                  s.set.half_widths[0], s.set.half_widths[1], s.set.half_widths[2], s.set.clearance,
                  s.passable() ? "" : ": not passable");
  }
  if (!sweep.smallest) {
    std::printf("no gains let this vehicle through: only a wider way, or calmer air, does\n");
    return;
  }
  const auto g = firmware_gains(*sweep.smallest);
  std::printf("smallest gains that let it through%s: %s %.3g, %s %.3g, %s %.3g, %s %.3g\n",
              sweep.smallest->factor == sweep.steps.front().factor ? " (or smaller ones)" : "", names[0].c_str(), g[0],
              names[1].c_str(), g[1], names[2].c_str(), g[2], names[3].c_str(), g[3]);
}

int run(const VehicleOptions& options) {
  auto vehicle = read_vehicle(options.vehicle);
  const auto model = read_model(options.model);
  Firmware firmware;
  if (!options.parameters.empty())
    firmware = take_gains(read_parameters(options.parameters), options.parameters, vehicle);
  std::optional<TuningEvidence> evidence;
  if (!options.log.empty()) evidence = evidence_of(options.log);
  read_reachability(vehicle, reach::Method::tight, reach::Loop::vehicle, options.vehicle);
  progress("building the world");
  const auto world =
      plan::build_world(read_map(options.map), model, vehicle, reach::Method::tight, std::nullopt, run_shown);
  // Half an octave apart, from half of what flies to four times as much.
  const std::vector<double> factors{0.5, 0.71, 1, 1.41, 2, 2.83, 4};
  const auto sweep = plan::sweep_gains(*world, *options.start, *options.goal, factors, run_shown);
  if (options.json) {
    Json steps = Json::array();
    for (const auto& s : sweep.steps) steps.push_back(to_json(s));
    Json json = {{"steps", std::move(steps)}, {"smallest", sweep.smallest ? to_json(*sweep.smallest) : Json()}};
    const auto& integral = vehicle.controller.velocity_integrator;
    json["velocity_integrator"] = {{"horizontal", integral.horizontal}, {"vertical", integral.vertical}};
    json["left_out"] = firmware.left_out.empty() ? Json() : Json(firmware.left_out);
    json["log"] = nullptr;
    if (evidence) json["log"] = {{"judged", evidence->judged}, {"inside", evidence->inside}};
    print(json);
  } else {
    print_text(sweep, firmware, vehicle, evidence);
  }
  return sweep.smallest ? kOk : kUnavailable;
}

}  // namespace

Verb vehicle_verb(Command& app) {
  auto options = std::make_shared<VehicleOptions>();
  auto& group =
      app.add_subcommand("vehicle", "Vehicle files: begun, checked, proposed from logs, and which gains a way needs");
  group.require_subcommand();
  auto& command = group.add_subcommand("tune", "The smallest gains with which a way is passable");
  command.add_option("--map", options->map, "OctoMap file or builtin:NAME").required();
  command.add_option("--model", options->model, "model file or builtin:NAME").required();
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME").required();
  add_point(command, "--start", options->start, "one end of the way, on one side of the door, m").required();
  add_point(command, "--goal", options->goal, "its other end, m").required();
  command.add_option("--parameters", options->parameters,
                     "the autopilot's parameter file, whose gains are taken in place of the vehicle file's");
  command.add_option("--log", options->log, "raw log of a flight with these gains: whether its sets held");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.footer(
      "Position and velocity gain are scaled together, so that damping stays. Faster gains need an attitude loop that "
      "follows:\nmeasure controller.attitude_lag and feedback_delay first.\nExample:\n"
      "  backwash vehicle tune --map builtin:apartment --model builtin:quad-5in --vehicle builtin:quad-5in \\\n"
      "    --start 3,4.2,1.2 --goal 7.4,3,1.2");
  const Verb printed = vehicle_print_verb(group), checked = vehicle_check_verb(group), fit = vehicle_fit_verb(group),
             from = vehicle_from_verb(group);
  return {&group, [options, printed, checked, fit, from] {
            if (printed.command->parsed()) return printed.run();
            if (fit.command->parsed()) return fit.run();
            if (from.command->parsed()) return from.run();
            return checked.command->parsed() ? checked.run() : run(*options);
          }};
}

}  // namespace backwash::services

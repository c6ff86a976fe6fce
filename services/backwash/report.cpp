// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/recorded_flight.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/flight_output.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/verb.hpp"
#include "services/parallel/parallel.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

struct Options {
  std::string log, truth, vehicle = "builtin:quad-5in", model, out;
  bool json = false, force = false;
};

template <typename T>
T take(tl::expected<T, log::LogError> value) {
  if (value) return std::move(*value);
  throw Failure(value.error().kind == log::LogError::Kind::not_found ? kNoInput : kBadData, value.error().message);
}

int run(const Options& options) {
  check_output(options.out, options.force);
  const auto vehicle = read_vehicle(options.vehicle);
  const std::string model_path = model_of(options.vehicle, options.model);
  const auto model = read_model(model_path);
  const auto log = take(log::read_raw_log(options.log)).records;
  const auto truth = take(log::read_csv(options.truth));
  progress("building the world");
  const auto world = plan::build_world(take(report::recorded_map(log)), model, vehicle, reach::Method::tight,
                                       std::nullopt, run_parallel);
  const auto flight = take(report::recorded_flight(log, truth, *world));
  const Vec3 start = flight.take_off.samples.back().command.p_W, goal = flight.route.samples.back().command.p_W;
  const report::ReportContext context{options.log, model_path, options.vehicle, kVersion, start, goal, {}, 1};
  return conclude({flight, *world, context, sim::summarise(flight, *world, goal)}, options.out, options.json,
                  options.force);
}

}  // namespace

Verb report_verb(Command& app) {
  auto options = std::make_shared<Options>();
  auto& command = app.add_subcommand("report", "Judges and draws a flight of the daemon from its raw log");
  command.add_option("--log", options->log, "raw log of backwashd").required();
  command.add_option("--truth", options->truth, "log of the truth by backwash-bench, CSV").required();
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME").capture_default_str();
  command.add_option("--model", options->model, "model file or builtin:NAME; a built-in vehicle has its own");
  command.add_option("--out", options->out, "HTML page to write");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "overwrite --out");
  command.footer(
      "The same judgement and exit codes as fly.\nExample:\n"
      "  backwash report --log flight.bwlog --truth truth.csv --out flight.html");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services

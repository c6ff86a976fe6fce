// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/recorded_map.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/fly/flight_story_output.hpp"
#include "services/backwash/fly/log_parts.hpp"
#include "services/backwash/fly/raw_report.hpp"
#include "services/backwash/fly/story_page.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/learn/study_flights.hpp"
#include "services/backwash/page_parts.hpp"
#include "services/backwash/site/world_cache.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

struct ReportOptions {
  std::vector<std::string> logs;  ///< parts of one; the first names it
  std::string truth, vehicle = "builtin:quad-5in", model, because, out;
  std::optional<double> risk;
  bool json = false, force = false;
  const std::string& log() const { return logs.front(); }
};

/// Any flight, by what the daemon recorded of it.
int tell(const ReportOptions& options, std::span<const log::RawRecord> log, const FlightStory& story,
         const map::OccupancyGrid* map, const Vehicle& vehicle) {
  if (!options.out.empty()) {
    const std::string model_path = model_of(options.vehicle, options.model);
    const auto model = read_both(options.vehicle, model_path, options.risk).second;
    const auto world = map ? world_of({*map, model, model_path, vehicle, options.vehicle}) : nullptr;
    progress("drawing the report");
    const auto page =
        story_page(story, log, map,
                   {options.log(), vehicle.body.radius, parameter_files(options.vehicle, model_path), world.get()});
    write_file(options.out, page, options.force);
  }
  options.json ? print(to_json(story, options.log())) : print_text(story, options.log());
  if (story.ok()) return kOk;
  throw Failure(kFlightFailed, options.log() + ":1: " + why(story));
}

/// The truth of the flight, where it is given.
std::optional<log::FlightLog> read_truth(const std::string& path) {
  if (path.empty()) return std::nullopt;
  auto truth = read_or_fail(log::read_csv(path));
  for (const char* name : {"x_m", "y_m", "z_m"})
    if (!truth.has(name)) throw Failure(kBadData, path + ":1: no column '" + name + "'; give backwash-bench's --log");
  if (truth.t_s.size() < 2) throw Failure(kBadData, path + ":1: has fewer than two rows; give the whole log");
  return truth;
}

int run(const ReportOptions& options) {
  if (is_autopilots_log(options.log()))
    return report_of_autopilots_log(options.log(), options.vehicle == ReportOptions{}.vehicle ? "" : options.vehicle,
                                    options.out, options.json, options.force);
  check_output(options.out, options.force);
  const auto vehicle = read_both(options.vehicle, options.model, options.risk).first;
  const auto log = read_or_fail(log::read_raw_logs(with_later_parts(options.logs)));
  const auto truth = read_truth(options.truth);
  const auto map = report::recorded_map(log.records);
  const auto* grid = map ? &*map : nullptr;
  progress("reading the log");
  const auto story = flight_story(log, vehicle, truth ? &*truth : nullptr, options.because);
  return tell(options, log.records, story, grid, vehicle);
}

}  // namespace

Verb report_verb(Command& app) {
  auto options = std::make_shared<ReportOptions>();
  auto& command = app.add_subcommand("report", "Judges and draws a flight of the daemon from its raw log");
  command
      .add_option("logs,--log", options->logs,
                  "raw log of backwashd, or parts of one in their order; of one file the later parts in its folder are "
                  "read too; or an autopilot's own")
      .required();
  command.add_option("--truth", options->truth,
                     "log of the truth by backwash-bench, CSV; without it measured positions are judged");
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME").capture_default_str();
  command.add_option("--model", options->model, "model file or builtin:NAME; a built-in vehicle has its own");
  add_risk(command, options->risk);
  command.add_option("--because", options->because, "what ended the flight, as you know it: stands first");
  command.add_option("--out", options->out, "HTML page to write");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "overwrite --out");
  command.footer(
      "Any raw log: several take-offs and routes, holds, refusals, one that never took off or was cut short.\n"
      "Judged by the sets that the daemon judged by. The exit codes of fly.\nExample:\n"
      "  backwash report --log flight.mcap --truth truth.csv --out flight.html");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services

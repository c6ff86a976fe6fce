// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <optional>
#include <sstream>

#include "core/study/findings/extend.hpp"
#include "core/study/findings/residuals.hpp"
#include "core/study/findings/study_page.hpp"
#include "core/study/findings/words.hpp"
#include "core/study/inference/rotors/rotor_reference.hpp"
#include "core/study/inference/rotors/sound_rotors.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/learn/calibrate_input.hpp"
#include "services/backwash/learn/study_before_after.hpp"
#include "services/backwash/learn/study_design.hpp"
#include "services/backwash/learn/study_flights.hpp"
#include "services/backwash/learn/study_output.hpp"
#include "services/backwash/learn/study_rows.hpp"
#include "services/backwash/learn/study_simulation.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

struct StudyOptions {
  CampaignFiles files;
  std::string model = "builtin:quad-5in", vehicle, report, out;
  std::vector<std::string> logs, reference;
  std::vector<CampaignFiles::Log> before, after;  // after, without before: changed keys of the vehicle file
  std::string group, from;
  unsigned seed = 1;
  DesignOptions design;
  bool json = false, force = false, quick = false, rules = false, residuals = false, rows = false;
};

/// An autopilot's own log numbers rotors 1 and 2 as facing ones; the verdict is about 1 and 3. Throws Failure.
void refuse_other_numbers(const std::vector<std::string>& logs) {
  const auto found = std::ranges::find_if(logs, is_autopilots_log);
  if (found != logs.end())
    throw Failure(kUsage, *found +
                              ":1: --reference takes rotors 1 and 3 as facing each other; in this log 1 faces 2: "
                              "import it and swap motor2 and motor3");
}

/// Motor shares of the flights against those of the reference flights; nothing without such.
std::optional<study::RotorVerdict> against_reference(const StudyOptions& options,
                                                     const std::optional<study::Observations>& sound,
                                                     const study::Observations& seen) {
  if (!sound) return std::nullopt;
  auto verdict = study::judge_rotors(study::rotor_shares(*sound), study::rotor_shares(seen));
  if (!verdict)
    throw Failure(
        kBadData,
        options.reference.front() +
            ":1: --reference needs 4 flights or more that are not judged as well, with motor1 … motor4, and the "
            "logs need these too");
  return verdict;
}

/// Ratios of the vertical variance by height and plate, day and speed held fixed, of recordings that say what they
/// stood on and under (`backwash import airgarage`).
std::optional<study::calibrate::HeightEffects> height_effects(const StudyOptions& options,
                                                              const std::vector<std::string>& logs, const Model& model,
                                                              const study::Observations& seen) {
  if (!options.files.maps.empty() || !seen.has(study::Source::ceiling)) return std::nullopt;
  if (!options.from.empty())
    throw Failure(kUsage, options.from + ":1: logs with a ceiling column need a --map, or --log in place of --from");
  return read_height_effects(logs, model, options.seed);
}

/// What one log at a time is asked for, and what needs more than is kept of each.
void check_rows(const StudyOptions& options) {
  const auto not_with = [](bool given, const std::string& option, const std::string& why) {
    if (given) throw Failure(kUsage, option + " " + why);
  };
  const std::string alone = "studies nothing: give it with --vehicle, --map, --model, --group and --log alone";
  not_with(options.rows && (options.json || options.residuals || !options.reference.empty() ||
                            !(options.out + options.report + options.from + options.design.points).empty()),
           "--rows", alone);
  not_with(!options.from.empty() && !options.files.logs.empty(), "--from",
           "takes the place of --log: give one of them");
  not_with(!options.after.empty() && (options.rows || !options.from.empty()), "--after", "needs the logs: give --log");
  not_with(!options.from.empty() && options.residuals, "--residuals", "needs the logs: give --log in place of --from");
}

bool compares(const StudyOptions& options) { return !options.before.empty(); }

/// --before and --after take the place of --log, and tell one thing alone.
void check_before_after(const StudyOptions& options) {
  if (!compares(options)) return;
  if (options.after.empty()) throw Failure(kUsage, "--before needs --after: the flights after the change");
  if (!options.logs.empty() || options.rows || options.residuals ||
      !(options.out + options.from + options.design.points).empty() || !options.reference.empty())
    throw Failure(kUsage,
                  "--before and --after go with --vehicle, --map, --model, --group, --report and --json, and in place "
                  "of --log");
  for (const auto& log : options.after)
    if (std::ranges::find(options.before, log.path, &CampaignFiles::Log::path) != options.before.end())
      throw Failure(kUsage, log.path + " is given before and after the change; give each flight once");
}

/// KEY=VALUE of --after without --before.
std::vector<config::ChangedKey> changed_keys(const StudyOptions& options) {
  std::vector<config::ChangedKey> changed;
  if (compares(options)) return changed;
  for (const auto& [text, map] : options.after) {
    const auto equals = text.find('=');
    std::istringstream number(equals == std::string::npos ? "" : text.substr(equals + 1));
    double value = 0;
    if (!(number >> value) || !(number >> std::ws).eof())
      throw Failure(kUsage, "--after " + text +
                                ": needs KEY=VALUE of the vehicle file, as body.mass=1.02; of flights after a change, "
                                "--before those before it");
    const auto key = text.substr(0, equals);
    if (std::ranges::find(changed, key, &config::ChangedKey::key) != changed.end())
      throw Failure(kUsage, "--after " + key + " is given twice; give each key once");
    changed.push_back({key, value});
  }
  return changed;
}

void check(const StudyOptions& options) {
  const bool mapless = options.files.maps.empty();
  if (options.vehicle.empty() || (options.files.logs.empty() && options.from.empty() && options.before.empty()))
    throw Failure(kUsage, "study needs --vehicle, and --log, --from or --before and --after");
  check_rows(options);
  check_before_after(options);
  if (options.residuals && (mapless || options.report.empty()))
    throw Failure(kUsage, "--residuals needs --map, to fly in, and --report, to draw on");
  std::vector<std::string> paths = options.reference;
  for (const auto& log : options.files.logs) paths.push_back(log.path);
  if (!options.reference.empty()) refuse_other_numbers(paths);
  check_design(options.design, mapless, options.force);
  check_outputs({options.report, options.out, options.design.points}, options.force);
}

study::StudyOptions study_options(const StudyOptions& options, const std::optional<study::Observations>& sound) {
  study::StudyOptions chosen;
  if (sound) chosen.sound = study::sound_rotors(*sound);
  chosen.search.seed = options.seed;
  chosen.search.progress = [](const std::string& line) { progress(line); };
  chosen.minimum_detectable = !options.quick;
  return chosen;
}

void write_page(const StudyOptions& options, const study::StudyResult& result, const study::Observations& seen,
                const study::PageContext& context) {
  progress("drawing");
  write_file(options.report, study::study_page(result, seen, context), options.force);
}

void write_model(const StudyOptions& options, const Model& model, const study::StudyResult& result,
                 const study::Observations& seen) {
  const auto text =
      study::extended_model_text(model, result, seen, options.model, kVersion, earlier_terms(options.model));
  write_file(options.out, text, options.force, model_refusal);
}

/// The vehicle file as its remedies say; nothing where none is a key of it, or where it would be no good one.
std::optional<Vehicle> corrected(const StudyOptions& options, const study::StudyResult& result,
                                 const Vehicle& vehicle) {
  auto changed = changed_keys(options);
  const auto before = changed.size();
  for (const auto& cause : result.causes)
    for (const auto& [key, from, to] : study::remedy_of(cause, vehicle).set) changed.push_back({key, to});
  if (changed.size() == before) return std::nullopt;
  const auto good = config::load_vehicle_with(options.vehicle, changed);
  return good ? std::optional(*good) : std::nullopt;
}

std::optional<study::Consequence> what_it_costs(const StudyOptions& options, const study::StudyResult& result,
                                                const study::Observations& seen, const Model& model,
                                                const Flights& flights, const LookedWith& with) {
  if (result.causes.empty()) return std::nullopt;
  progress("hover sets and a plan, before and after");
  std::vector<const map::OccupancyGrid*> grids;
  for (const std::size_t k : flights.order())
    if (const auto& grid = with.rooms[flights.rooms[k]].grid) grids.push_back(&*grid);
  return study::consequence(result, seen, model, with.vehicle, grids, corrected(options, result, with.vehicle),
                            run_shown);
}

void print_beside(const Flights& flights, const std::optional<study::Design>& design, const DesignOptions& asked) {
  for (const auto& [log, known] : flights.twice)
    std::printf("counted once: %s is %s again\n", log.c_str(), known.c_str());
  if (design) print_text(*design, asked);
}

void add_left_out(Json& json, const std::vector<study::ExtensionTerm>& terms, const Flights& flights) {
  for (const auto& term : terms) json["not_applied"].push_back({{"name", term.cause}, {"form", term.formula}});
  for (const auto& [log, known] : flights.twice) json["counted_once"].push_back({{"log", log}, {"same_as", known}});
}

RowsOf rows_of(const StudyOptions& options) {
  return {options.vehicle, options.model, options.group, options.files.maps};
}

Flights read_flights(const StudyOptions& options, const LookedWith& with) {
  std::vector<StudiedFlight> studied;
  std::vector<log::FlightLog> logs;
  if (options.from.empty()) {
    each_readable(options.files, with.notes, [&](const auto& path, std::size_t room) {
      studied.push_back(
          look_at(path, room, options.group, with, options.residuals || compares(options) ? &logs : nullptr));
    });
  } else {
    progress("reading " + options.from);
    studied = read_study_rows(options.from, rows_of(options));
    for (const auto& flight : studied)
      if (flight.place) with.notes.place({flight.path, with.rooms[flight.room].name, *flight.place});
  }
  progress("looking for flights that come twice");
  auto flights = each_once(std::move(studied), !options.group.empty(), std::move(logs));
  if (!options.reference.empty()) refuse_other_numbers(flights.paths);
  return flights;
}

int print_rows(const StudyOptions& options, const LookedWith& with) {
  each_readable(options.files, with.notes, [&](const auto& path, std::size_t room) {
    const auto row = study_row(look_at(path, room, options.group, with, nullptr), rows_of(options));
    end_progress();
    std::fputs(row.c_str(), stdout);
  });
  return kOk;
}

int run(const StudyOptions& options) {
  if (options.rules) {
    print_rules(options.json);
    return kOk;
  }
  check(options);
  const auto changed = changed_keys(options);
  const auto vehicle = read_vehicle(options.vehicle, changed);
  auto model = read_model(options.model);
  model.ground.r0 = vehicle.body.diagonal_radius;
  std::deque<Room> rooms;
  for (const auto& map : options.files.maps) rooms.emplace_back(map, model);
  if (rooms.empty()) rooms.emplace_back("", model);
  LogNotes notes{"backwash study", {}, {}, {}};
  const LookedWith with{vehicle, rooms, notes};
  if (options.rows) return print_rows(options, with);
  Flights flights = read_flights(options, with);
  std::string maps;
  for (const auto& map : options.files.maps) maps += (maps.empty() ? "" : ", ") + map;
  if (compares(options))
    return study_before_after(
        {options.after, options.report,
         "Map " + (maps.empty() ? "none" : maps) + ", vehicle " + options.vehicle + ", model " + options.model,
         options.json, options.force},
        std::move(flights), with);
  const auto sound = sound_flights(options.reference, with, model, flights);
  auto chosen = study_options(options, sound);
  auto seen = observations(flights, with);
  const auto measured = options.residuals ? seen : study::Observations{};  // nothing that the model holds taken out
  auto terms = study::apply(read_terms(options.model), seen);
  chosen.search.known = std::move(terms.known);
  const auto result = study::study(seen, chosen);
  const auto names = flights.names();
  Json json = services::to_json(result, seen, vehicle, names);
  add_left_out(json, terms.left, flights);
  if (!options.group.empty()) json["groups"] = {{"by", options.group}, {"count", seen.units.size()}};
  for (const auto& [key, value] : changed) json["after"].push_back({{"key", key}, {"to", value}});
  const auto height = height_effects(options, flights.paths, model, seen);
  if (height) json["height_effect"] = services::to_json(*height);
  const auto rotors = against_reference(options, sound, seen);
  if (rotors) json["rotors_against_reference"] = services::to_json(*rotors);
  const auto consequence = what_it_costs(options, result, seen, model, flights, with);
  if (consequence) json["consequence"] = services::to_json(*consequence);
  const auto& first = rooms.front().grid;
  const auto design = designed(options.design, seen, result, model, vehicle, first ? &*first : nullptr, options.force);
  if (design) json["design"] = services::to_json(*design, options.design);
  if (!options.out.empty()) {
    write_model(options, model, result, seen);
    json["extended_model"] = options.out;
  }
  if (!options.report.empty()) {
    std::string beside = design ? html(*design, options.design) : "";
    report::PageData data;
    if (options.residuals)
      beside += residuals({options.model, model, options.seed}, flights, with, measured,
                          study::simulation_of(result, seen), data);
    write_page(options, result, seen,
               {maps, options.model, options.vehicle, kVersion, consequence, rotors, height, beside, data, vehicle,
                names, html(notes)});
  }
  if (!options.json) print_text(notes);
  options.json ? print(told_first(notes, json))
               : services::print_text(result, seen, vehicle, names, consequence, rotors, height);
  if (!options.json) print_beside(flights, design, options.design);
  return kOk;
}

}  // namespace

Verb study_verb(Command& app) {
  auto options = std::make_shared<StudyOptions>();
  auto& command = app.add_subcommand("study", "What the simulation gets wrong, by name, with the gain");
  command.add_option("logs", options->logs, "such logs, where there is one map or none");
  add_campaign_options(command, options->files);
  command
      .add_texts(
          "--before", [options](const auto& logs) { append(options->before, logs, options->files); },
          "flights before a change of the vehicle, with --after: did it help?")
      .trigger_on_parse();
  command
      .add_texts(
          "--after", [options](const auto& given) { append(options->after, given, options->files); },
          "flights after it; without --before KEY=VALUE as if the vehicle file said so: body.mass=1.02")
      .trigger_on_parse();
  command.add_option("--model", options->model, "model file or builtin:NAME").capture_default_str();
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME");
  command.add_flag("--rows", options->rows,
                   "prints what a study keeps of each log as a line of JSON, and nothing else");
  command.add_option("--from", options->from, "such lines, in order, in place of logs").type_name("FILE");
  command.add_option(
      "--reference", options->reference,
      "flights of the same vehicle known to be sound, 4 or more: the --log flights' motor shares are judged against "
      "theirs, as one condition");
  command.add_option("--group", options->group,
                     "column, such as day: flights with one value of it are left out, flipped and scattered together");
  command.add_option("--report", options->report, "HTML page to write");
  command.add_flag("--residuals", options->residuals,
                   "on the page, per channel: what the simulation of these flights says and what was measured");
  add_design(command, options->design);
  command.add_option("--out", options->out, "extended model file to write");
  command.add_option("--seed", options->seed, "of the null's sign draws").capture_default_str();
  command.add_flag("--quick", options->quick, "without the smallest effects that could have been found");
  command.add_flag("--rules", options->rules, "prints every constant with unit and reason, and nothing else");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "overwrite --report, --out and --design");
  command.footer(
      "Each log belongs to the --map before it (or the only one).\nExample:\n  backwash study --map room.bt --log "
      "room-*.csv --map hall.bt --log hall-*.csv --model builtin:quad-5in --vehicle builtin:quad-5in --report "
      "study.html "
      "--out extended.toml");
  return {&command, [options] {
            keep_pages();
            for (const auto& log : options->logs)
              options->files.logs.push_back(
                  {log, options->files.maps.size() == 1 ? std::optional<std::size_t>(0) : std::nullopt});
            if (compares(*options))
              for (const auto* side : {&options->before, &options->after})
                options->files.logs.insert(options->files.logs.end(), side->begin(), side->end());
            return run(*options);
          }};
}

}  // namespace backwash::services

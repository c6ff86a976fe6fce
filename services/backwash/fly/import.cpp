// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <filesystem>
#include <functional>
#include <set>
#include <utility>

#include "core/log/autopilot/same_flight.hpp"
#include "core/log/columns/import_columns.hpp"
#include "core/log/columns/labels.hpp"
#include "core/log/kinds/recording.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/site/column_map.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

using Importer = std::function<tl::expected<log::FlightLog, log::LogError>(const std::string& path)>;

struct ImportOptions {
  std::string kind, folder, map_columns, columns, labels;
  std::vector<std::string> files;  ///< after `kind`, which is the first of them with a column map
  bool propose = false, json = false, force = false;
};

/// The kind of recordings that a first word names; none: it is a file, and each of them says itself what it is.
const log::RecordingKind* kind_of(const ImportOptions& options) {
  std::string known;
  for (const auto& entry : log::importable_recordings()) {
    if (options.kind == entry.name) return &entry;
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  std::error_code unknown;
  if (std::filesystem::exists(options.kind, unknown) || options.kind.find_first_of("./") != std::string::npos)
    return nullptr;
  throw Failure(kUsage, "'" + options.kind + "' is no kind of recording; known are " + known + "; nor is it a file");
}

/// The importer that the options name, and the recordings.
std::pair<Importer, std::vector<std::string>> importer_of(const ImportOptions& options) {
  std::vector<std::string> files{options.kind};
  files.insert(files.end(), options.files.begin(), options.files.end());
  if (options.map_columns.empty()) {
    const auto* kind = kind_of(options);
    if (kind && options.files.empty())
      throw Failure(kUsage, "no recording given after the kind '" + options.kind + "'");
    const auto read = kind ? kind->read : log::read_recording;
    return {read, kind ? options.files : files};
  }
  const auto map = read_column_map(options.map_columns);
  if (!map)
    throw Failure(map.error().kind == config::ConfigError::Kind::not_found ? kNoInput : kConfiguration,
                  map.error().message);
  return {[map = *map](const std::string& path) { return log::import_columns(path, map); }, files};
}

[[noreturn]] void fail(const log::LogError& error) {
  throw Failure(error.kind == log::LogError::Kind::not_found ? kNoInput : kBadData, error.message);
}

int propose(const ImportOptions& options) {
  if (!options.files.empty()) throw Failure(kUsage, "--propose looks at one table; give one");
  if (!options.folder.empty() || !options.labels.empty())
    throw Failure(kUsage, "--propose prints and writes nothing; give it without --out and --labels");
  const auto text = proposed_column_map(options.kind, options.columns);
  if (!text) fail(text.error());
  std::fputs(text->c_str(), stdout);
  return kOk;
}

/// FOLDER/NAME.csv; of NAME.csv.gz as well.
std::string target(const std::string& folder, const std::string& file) {
  return (std::filesystem::path(folder) / log::recording_name(file)).string() + ".csv";
}

log::Labels labels_of(const ImportOptions& options) {
  if (options.labels.empty()) return {};
  auto labels = log::read_labels(options.labels);
  if (!labels) fail(labels.error());
  return std::move(*labels);
}

/// Puts what the labels say of a recording into its log; of one that they do not hold, a note.
void add_labels(log::FlightLog& log, const log::Labels& labels, const std::string& labels_file, const std::string& file,
                std::vector<std::string>& notes) {
  if (labels_file.empty()) return;
  const auto of = labels.find(log::recording_name(file));
  if (of == labels.end()) return notes.push_back(file + ": " + labels_file + " has no row for it");
  if (const auto added = log::add_labels(log, of->second, labels_file); !added) fail(added.error());
}

int run(const ImportOptions& options) {
  if (options.propose) return propose(options);
  if (!options.columns.empty()) throw Failure(kUsage, "--columns names a table's columns for --propose");
  auto [read, files] = importer_of(options);
  if (options.folder.empty()) throw Failure(kUsage, "--out is required: the folder for the flight logs");
  std::error_code error;
  std::filesystem::create_directories(options.folder, error);
  if (!std::filesystem::is_directory(options.folder))
    throw Failure(kCannotCreate, options.folder + ":1: cannot be created; name a folder that can be written");
  std::vector<std::string> twice, targets;
  std::set<std::filesystem::path> once;
  std::erase_if(files, [&](const std::string& file) {
    const bool again = !once.insert(std::filesystem::weakly_canonical(file, error)).second;
    if (again) twice.push_back(file + ":1: is given twice; read once");
    return again;
  });
  for (const auto& file : files) targets.push_back(target(options.folder, file));
  check_outputs(targets, options.force);
  const auto labels = labels_of(options);
  Json logs = Json::array(), refused = twice;
  log::KnownFlights known;
  std::vector<std::string> notes;
  for (const auto& file : files) {
    auto log = read(file);
    if (!log) {
      // A recording without rows is not the end of a hundred others; alone it is an error.
      if (files.size() == 1 || log.error().kind == log::LogError::Kind::not_found) fail(log.error());
      refused.push_back(log.error().message);
      continue;
    }
    for (const auto& note : log->notes) notes.push_back(file + ": " + note);
    if (const auto same = known.again(file, log::FlightMark(*log)); !same.empty()) {
      refused.push_back(same);
      continue;
    }
    add_labels(*log, labels, options.labels, file, notes);
    write_log(target(options.folder, file), *log, options.force);
    logs.push_back(Json{{"log", target(options.folder, file)}, {"rows", log->t_s.size()}});
  }
  if (logs.empty()) throw Failure(kBadData, refused.front().get<std::string>());
  if (options.json) {
    print(Json{{"kind", !options.map_columns.empty() ? "columns"
                        : kind_of(options)           ? options.kind
                                                     : "by content"},
               {"logs", logs},
               {"refused", refused},
               {"notes", notes}});
  } else {
    std::printf("%zu flight logs written to %s\n", logs.size(), options.folder.c_str());
    for (const auto& note : notes) std::printf("%s\n", note.c_str());
    for (const auto& why : refused) std::printf("left out: %s\n", why.get<std::string>().c_str());
  }
  return kOk;
}

}  // namespace

Verb import_verb(Command& app) {
  auto options = std::make_shared<ImportOptions>();
  auto& command = app.add_subcommand("import", "Recordings of others as flight logs");
  command
      .add_option("kind", options->kind,
                  "airgarage, ardupilot, crazypad, flight-log, mcap or ulog; left out, each file says what it is")
      .required();
  command.add_option("files", options->files, "recordings");
  command.add_option("-o,--out", options->folder, "folder for the flight logs, one CSV each");
  command.add_option("--map-columns", options->map_columns, "column map (TOML): recordings are tables, CSV or .csv.gz");
  command.add_option("--labels", options->labels,
                     "table (CSV) of what is known of each recording: its name under recording, and a column a label");
  command.add_flag("--propose", options->propose,
                   "print a column map for one table, guessed and checked; writes nothing");
  command.add_option("--columns", options->columns,
                     "with --propose: names in place of the table's own, as t,x,y,z,- (- leaves one out)");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "overwrite logs that exist");
  command.footer(
      "Kinds are known by content; names, .gz and .zip do not matter.\n"
      "Example:\n  backwash import flight.ulg 20240823_16_23_49.csv.gz -o logs\n"
      "  backwash import --propose flight.csv > map.toml\n  backwash import --map-columns map.toml flight*.csv -o "
      "logs");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services

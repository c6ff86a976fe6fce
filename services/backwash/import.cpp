// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <filesystem>

#include "core/log/import_airgarage.hpp"
#include "core/log/import_crazypad.hpp"
#include "core/log/ulog.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

using Importer = tl::expected<log::FlightLog, log::LogError> (*)(const std::string& path);

/// Kinds of recordings; add a line for a new one.
constexpr struct {
  const char* kind;
  Importer import;
} kImporters[] = {
    {"airgarage", log::import_airgarage},
    {"crazypad", log::import_crazypad},
    {"ulog", log::read_ulog},
};

struct Options {
  std::string kind, folder;
  std::vector<std::string> files;
  bool json = false, force = false;
};

Importer importer(const std::string& kind) {
  std::string known;
  for (const auto& entry : kImporters) {
    if (kind == entry.kind) return entry.import;
    known += (known.empty() ? "" : ", ") + std::string(entry.kind);
  }
  throw Failure(kUsage, "'" + kind + "' is no kind of recording; known are " + known);
}

int run(const Options& options) {
  const Importer read = importer(options.kind);
  std::error_code error;
  std::filesystem::create_directories(options.folder, error);
  if (!std::filesystem::is_directory(options.folder))
    throw Failure(kCannotCreate, options.folder + ":1: cannot be created; name a folder that can be written");
  const auto target = [&](const std::string& file) {
    return (std::filesystem::path(options.folder) / std::filesystem::path(file).stem()).string() + ".csv";
  };
  for (const auto& file : options.files) refuse_to_overwrite(target(file), options.force);
  Json logs = Json::array(), refused = Json::array();
  for (const auto& file : options.files) {
    const auto log = read(file);
    if (!log) {
      // A recording without rows is not the end of a hundred others; alone it is an error.
      if (options.files.size() == 1 || log.error().kind == log::LogError::Kind::not_found)
        throw Failure(log.error().kind == log::LogError::Kind::not_found ? kNoInput : kBadData, log.error().message);
      refused.push_back(log.error().message);
      continue;
    }
    const auto written = log::write_csv(target(file), *log, options.force);
    if (!written) throw Failure(kCannotCreate, written.error().message);
    logs.push_back(Json{{"log", target(file)}, {"rows", log->t_s.size()}});
  }
  if (logs.empty()) throw Failure(kBadData, refused.front().get<std::string>());
  if (options.json) {
    print(Json{{"kind", options.kind}, {"logs", logs}, {"refused", refused}});
  } else {
    std::printf("%zu flight logs written to %s\n", logs.size(), options.folder.c_str());
    for (const auto& why : refused) std::printf("left out: %s\n", why.get<std::string>().c_str());
  }
  return kOk;
}

}  // namespace

Verb import_verb(CLI::App& app) {
  auto options = std::make_shared<Options>();
  auto* command = app.add_subcommand("import", "Recordings of others as flight logs");
  command->add_option("kind", options->kind, "airgarage, crazypad or ulog")->required();
  command->add_option("files", options->files, "recordings")->required();
  command->add_option("-o,--out", options->folder, "folder for the flight logs, one CSV each")->required();
  command->add_flag("--json", options->json, "one JSON object on stdout");
  command->add_flag("--force", options->force, "overwrite logs that exist");
  command->footer("Example:\n  backwash import airgarage 20240823_16_23_49.csv -o logs");
  return {command, [options] { return run(*options); }};
}

}  // namespace backwash::services

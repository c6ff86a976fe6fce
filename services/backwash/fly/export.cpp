// SPDX-License-Identifier: BSD-3-Clause
#include <cinttypes>
#include <cstdio>

#include "core/log/mcap/mcap_flight.hpp"
#include "core/log/raw/raw_flight.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

struct ExportOptions {
  std::vector<std::string> logs;
  std::string mcap, csv;
  bool json = false, force = false;
};

int run(const ExportOptions& options) {
  if (options.mcap.empty() && options.csv.empty())
    throw Failure(kUsage, "nothing to write; give --mcap, --csv or both");
  check_outputs({options.mcap, options.csv}, options.force);
  progress("reading the log");
  const auto log = read_or_fail(log::read_raw_logs(options.logs));
  Json json = {{"log", options.logs.front()}, {"cut_at", log.cut_at ? Json(*log.cut_at) : Json()}};
  std::string text;
  if (!options.csv.empty()) {
    const auto flight = read_or_fail(log::flight_of_raw_log(log, options.logs.front()));
    write_log(options.csv, flight, options.force);
    json["rows"] = flight.t_s.size();
    text += std::to_string(flight.t_s.size()) + " rows in " + options.csv + "\n";
  }
  if (!options.mcap.empty()) {
    progress("writing " + options.mcap);
    std::map<std::string, std::uint64_t> messages;
    write_stream(options.mcap, options.force,
                 [&](std::ostream& file) { messages = log::export_mcap(file, log, kVersion); });
    json["messages"] = messages;
    for (const auto& [topic, count] : messages)
      text += std::to_string(count) + (count == 1 ? " message" : " messages") + " on " + topic + "\n";
  }
  if (log.cut_at) text += "the last record is cut short at byte " + std::to_string(*log.cut_at) + " and left out\n";
  options.json ? print(json) : static_cast<void>(std::fputs(text.c_str(), stdout));
  return kOk;
}

}  // namespace

Verb export_verb(Command& app) {
  auto options = std::make_shared<ExportOptions>();
  auto& command =
      app.add_subcommand("export", "A raw log as a flight log (CSV); its parts, or one of before, as one MCAP");
  command.add_option("logs", options->logs, "raw log of backwashd, or parts of one in their order").required();
  command.add_option(
      "--mcap", options->mcap,
      "MCAP file to write, as the daemon writes it: parts joined, the format of before too, large maps drawn");
  command.add_option("--csv", options->csv, "flight log to write, CSV");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "overwrite files that exist");
  command.footer(
      "A raw log is an MCAP file, which Foxglove and rosbag2 open as it lies there.\n"
      "Example:\n  backwash export flight.mcap --csv flight.csv\n"
      "  backwash export flight.mcap flight-2.mcap --mcap whole.mcap");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services

// SPDX-License-Identifier: BSD-3-Clause
#include <cinttypes>
#include <cstdio>

#include "core/log/raw/tick_log.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

constexpr int kDiffers = 1;

struct ReplayOptions {
  std::vector<std::string> logs;
  bool json = false;
};

std::string hex(std::uint64_t value) {
  char text[20];
  std::snprintf(text, sizeof text, "%016" PRIx64, value);
  return text;
}

Json to_json(const log::Replay& r, bool equal) {
  Json json = {{"equal", equal},
               {"ticks", r.ticks},
               {"ticks_missing", r.ticks_missing},
               {"segments", r.segments},
               {"setpoints", r.setpoints},
               {"differing_ticks", r.differing},
               {"decisions_hash", hex(r.state_hash)},
               {"stopped", r.stopped}};
  if (r.first)
    json["first_difference"] = {{"tick", r.first->tick},
                                {"byte", r.first->offset},
                                {"field", r.first->field},
                                {"logged", r.first->logged},
                                {"replayed", r.first->replayed}};
  return json;
}

int run(const ReplayOptions& options) {
  auto log = read_or_fail(log::read_raw_logs(options.logs));
  // A kill leaves a last record that is cut short, and perhaps the input of a tick that was not written any more.
  while (log.cut_at && !log.records.empty() && log.records.back().header.kind != log::RecordKind::tick)
    log.records.pop_back();
  const log::Replay r = read_or_fail(log::replay(log, options.logs.front()));
  const bool equal = r.differing == 0 && r.ticks_missing == 0;
  if (options.json) {
    Json json = to_json(r, equal);
    json["cut_at"] = log.cut_at ? Json(*log.cut_at) : Json();
    print(json);
    return equal ? kOk : kDiffers;
  }
  std::printf("%" PRIu64 " ticks, %" PRIu64 " set-points, %" PRIu64 " segments replayed; decisions %s\n", r.ticks,
              r.setpoints, r.segments, hex(r.state_hash).c_str());
  if (log.cut_at)
    std::printf("the last record is cut short at byte %" PRIu64 ": replayed up to the tick before it\n", *log.cut_at);
  if (!r.stopped.empty()) std::printf("%s: replayed up to the tick before it\n", r.stopped.c_str());
  if (r.ticks_missing > 0) std::printf("%" PRIu64 " ticks are missing from the log\n", r.ticks_missing);
  if (r.first)
    std::printf(
        "%" PRIu64 " ticks differ; first: tick %" PRIu64 " (byte %" PRIu64 "), %s: logged %.17g, replayed %.17g\n",
        r.differing, r.first->tick, r.first->offset, r.first->field.c_str(), r.first->logged, r.first->replayed);
  else
    std::printf("every decision is the same, bit for bit\n");
  return equal ? kOk : kDiffers;
}

}  // namespace

Verb replay_verb(Command& app) {
  auto options = std::make_shared<ReplayOptions>();
  auto& command = app.add_subcommand("replay", "Runs a raw log's inputs through the flight pipeline's tick again");
  command.add_option("logs,--log", options->logs, "raw log of backwashd, or its parts from the first on").required();
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.footer(
      "Every tick is decided again from its logged inputs (odometry, telemetry, segments, requests, map verdicts) and\n"
      "compared bit for bit: mode, reason, set-point in both frames, what was asked to be sent, the set and the "
      "verdict.\n"
      "Exit code 0: all equal; 1: something differs or is missing; 65: the log is damaged.\nExample:\n"
      "  backwash replay --log flight.mcap --json");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services

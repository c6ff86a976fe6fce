// SPDX-License-Identifier: BSD-3-Clause
#include <cinttypes>
#include <cstdio>

#include "core/log/autopilot/autopilot_flight.hpp"
#include "core/log/kinds/recording.hpp"
#include "core/log/mcap/mcap_flight.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/learn/study_flights.hpp"
#include "services/command_line/words.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

struct MergeOptions {
  std::vector<std::string> logs;  ///< parts of ours, then the autopilot's
  std::string out;
  bool json = false, force = false;
};

/// The distance of its poses from what was told, where they are those of this flight: the clocks count from each start
/// of the autopilot, and by them alone any of its logs fits somewhere.
double of_this_flight(const std::string& ours, const std::string& theirs, std::optional<double> distance) {
  constexpr double kFar = 1;  // m; of one flight 20 ms of the link at 3 m/s are 0.06
  if (!distance)
    throw Failure(kBadData, theirs + ":1: none of its poses is of the time of " + ours + ": is it of another start?");
  if (*distance < kFar) return *distance;
  char far[32];
  std::snprintf(far, sizeof far, "%.1f", *distance);
  throw Failure(kBadData, theirs + ":1: its poses are " + far + " m (median) from those that the autopilot sent in " +
                              ours + " at the same times: give the log of this flight");
}

int run(const MergeOptions& options) {
  if (options.logs.size() < 2) throw Failure(kUsage, "needs two logs: that of backwashd, then the autopilot's");
  const std::string &ours = options.logs.front(), &theirs = options.logs.back();
  if (!is_autopilots_log(theirs))
    throw Failure(kUsage, theirs + " is no autopilot's log; give PX4's or ArduPilot's own last");
  check_output(options.out, options.force);
  progress("reading the logs");
  const auto log = read_or_fail(log::read_raw_logs(std::span(options.logs).first(options.logs.size() - 1)));
  const auto pairs = log::clock_pairs(log);
  if (pairs.empty())
    throw Failure(kBadData, ours + ":1: holds no answer of the autopilot to TIMESYNC: the clocks cannot be compared");
  const auto clock = log::clock_line(pairs);
  const auto topics = read_or_fail(log::read_autopilots_log(theirs));
  for (const auto& words : topics.loss.words()) say_error("backwash merge", theirs + ":1: " + words);
  const auto poses = log::autopilot_poses(topics, clock);
  if (!poses) throw Failure(kBadData, theirs + ":1: " + poses.error());
  const double distance = of_this_flight(ours, theirs, log::distance_from_link(log, *poses));
  std::map<std::string, std::uint64_t> messages;
  write_stream(options.out, options.force,
               [&](std::ostream& file) { messages = log::export_mcap(file, log, kVersion, *poses); });
  const auto merged = messages[std::string(log::kAutopilotTopic)];
  if (options.json)
    print(Json{{"log", ours},
               {"autopilot", theirs},
               {"clock",
                {{"pairs", clock.pairs},
                 {"rate_ppm", 1e6 * clock.rate},
                 {"rms_ms", 1e3 * clock.rms_s},
                 {"largest_ms", 1e3 * clock.largest_s},
                 {"round_trip_ms", 1e3 * clock.round_trip_s}}},
               {"distance_m", distance},
               {"messages", messages},
               {"outside", poses->size() - merged}});
  else
    std::printf(
        "clocks               %zu exchanges, %.1f ppm apart, residual %.3f ms rms, %.3f ms at most (round trip %.1f "
        "ms)\n"
        "the autopilot's      %" PRIu64 " poses, %" PRIu64
        " outside the time of our log, %.3f m from what it sent us "
        "(median)\n",
        clock.pairs, 1e6 * clock.rate, 1e3 * clock.rms_s, 1e3 * clock.largest_s, 1e3 * clock.round_trip_s, merged,
        poses->size() - merged, distance);
  return kOk;
}

}  // namespace

Verb merge_verb(Command& app) {
  auto options = std::make_shared<MergeOptions>();
  auto& command = app.add_subcommand("merge", "A raw log and the autopilot's own as one MCAP on one clock");
  command.add_option("logs", options->logs, "raw log of backwashd (or its parts), then the autopilot's: .ulg or .bin")
      .required();
  command.add_option("-o,--out", options->out, "MCAP file to write").required();
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "overwrite a file that exists");
  command.footer("Example:\n  backwash merge flight.mcap fc.ulg -o both.mcap");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services

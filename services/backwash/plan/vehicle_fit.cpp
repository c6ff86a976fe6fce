// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/plan/vehicle_fit.hpp"

#include <cstdio>
#include <deque>
#include <set>

#include "core/study/loop/loop_fit.hpp"
#include "core/types/formatted.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/learn/study_flights.hpp"
#include "services/backwash/plan/logged_vehicle.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

using namespace study;

constexpr std::size_t kFewest = 3;  // logs: of two, leaving one out says nothing of how much flights differ

struct VehicleFitOptions {
  std::vector<std::string> logs;
  std::string vehicle, out;
  bool json = false, force = false;
};

/// What would excite a key, for the one who has to fly it.
const char* remedy(LoopKey key) {
  if (key == kLatency)
    return "fly back and forth with the vehicle's limits, several times: in hover nothing is asked for";
  if (key == kKpUp || key == kKdUp) return "climb and sink by a metre with the vehicle's limits, several times";
  return "fly sideways with the vehicle's limits, several times, with the attitude in the log";
}

/// "A and B do not excite KEY: what to fly", of each key.
std::string unexcited_line(const std::vector<UnexcitedLoop>& unexcited) {
  std::string line;
  for (std::size_t k = 0; k < kLoopKeys; ++k) {
    std::vector<std::string> logs;
    for (const auto& u : unexcited)
      if (u.key == k) logs.push_back(u.log);
    if (logs.empty()) continue;
    if (!line.empty()) line += "; ";
    for (std::size_t n = 0; n < logs.size(); ++n)
      line += (n == 0 ? "" : n + 1 < logs.size() ? ", " : " and ") + logs[n];
    const auto key = static_cast<LoopKey>(k);
    line +=
        (logs.size() > 1 ? " do not excite " : " does not excite ") + std::string(name_of(key)) + ": " + remedy(key);
  }
  return line;
}

/// Key and value as the file has them, the interval behind it.
std::string toml_line(const LoopFit& fit, const char* key, LoopKey one, std::optional<LoopKey> other = {}) {
  const auto interval = [&](LoopKey k) { return formatted("%.4g to %.4g", fit.keys[k]->low, fit.keys[k]->high); };
  if (!other) return formatted("%s = %.4g  # %s\n", key, fit.keys[one]->value, interval(one).c_str());
  return formatted("%s = { horizontal = %.4g, vertical = %.4g }  # %s; %s\n", key, fit.keys[one]->value,
                   fit.keys[*other]->value, interval(one).c_str(), interval(*other).c_str());
}

std::string proposal(const LoopFit& fit, const std::string& vehicle, const std::vector<LoopLog>& logs) {
  std::string text = "# Proposed by backwash vehicle fit " + std::string(kVersion) +
                     ", 90 % intervals behind each key, for " + vehicle + ":\n";
  for (const auto& log : logs) text += "# " + log.name + "\n";
  return text + "[controller]\n" + toml_line(fit, "kp", kKpLevel, kKpUp) + toml_line(fit, "kd", kKdLevel, kKdUp) +
         toml_line(fit, "latency", kLatency) + toml_line(fit, "attitude_lag", kLag);
}

Json to_json(const LoopFit& fit, const std::vector<LoopLog>& logs, const Vehicle& vehicle) {
  Json keys = Json::object(), unexcited = Json::array(), names = Json::array();
  for (const auto& log : logs) names.push_back(log.name);
  for (std::size_t k = 0; k < kLoopKeys; ++k) {
    const auto key = static_cast<LoopKey>(k);
    if (const auto& e = fit.keys[k])
      keys[std::string(name_of(key))] = {
          {"value", e->value}, {"ci90", {e->low, e->high}}, {"file", value_of(vehicle, key)}};
  }
  for (const auto& u : fit.unexcited)
    unexcited.push_back({{"log", u.log}, {"key", std::string(name_of(u.key))}, {"flight", remedy(u.key)}});
  return {{"logs", std::move(names)},
          {"windows", fit.windows},
          {"level_by", fit.by_attitude ? "attitude" : "position"},
          {"vertical_by", fit.by_thrust ? "thrust" : "position"},
          {"keys", keys},
          {"unexcited", unexcited}};
}

void print_text(const LoopFit& fit, const Vehicle& vehicle) {
  std::printf("%zu windows; level by %s, vertical by %s\n", fit.windows, fit.by_attitude ? "the attitude" : "positions",
              fit.by_thrust ? "the thrust" : "positions");
  std::printf("%-26s %9s   %-18s %9s\n", "key", "proposed", "90 % interval", "the file");
  for (std::size_t k = 0; k < kLoopKeys; ++k) {
    const auto key = static_cast<LoopKey>(k);
    const double now = value_of(vehicle, key);
    if (const auto& e = fit.keys[k])
      std::printf("%-26s %9.4g   %-18s %9.4g%s\n", name_of(key).data(), e->value,
                  formatted("%.4g to %.4g", e->low, e->high).c_str(), now,
                  now < e->low || now > e->high ? "  outside" : "");
  }
}

/// Fits without the logs that tell nothing of any loop, such as one of some seconds, and, where enough are left,
/// without those that do not excite a key: takes them out of `named`. Throws Failure 65 with the first that was left
/// out, where fewer than kFewest are left.
LoopFit fit_those_that_tell(std::vector<LoopLog>& named, const Vehicle& vehicle, LogNotes& notes) {
  const auto leave_out = [&](const std::string& log, const std::string& why) {
    if (std::erase_if(named, [&](const LoopLog& one) { return one.name == log; }) > 0) notes.left_out(log, why);
  };
  while (named.size() >= kFewest) {
    auto fit = fit_loop(named, vehicle);
    if (!fit) {
      leave_out(fit.error().log, fit.error().log + ":1: " + fit.error().what);
      continue;
    }
    std::set<std::string> dull;
    for (const auto& u : fit->unexcited) dull.insert(u.log);
    if (dull.empty() || named.size() < kFewest + dull.size()) return std::move(*fit);
    for (const auto& log : dull) {
      auto of = fit->unexcited;
      std::erase_if(of, [&](const UnexcitedLoop& u) { return u.log != log; });
      leave_out(log, unexcited_line(of));
    }
  }
  throw Failure(kBadData, notes.logs.front().second + "; of the " + std::to_string(kFewest) + " logs that are needed " +
                              std::to_string(named.size()) + " are left");
}

int fit_vehicle(const VehicleFitOptions& options) {
  check_output(options.out, options.force);
  const auto vehicle = read_vehicle(options.vehicle);
  if (options.logs.size() < kFewest)
    throw Failure(kUsage, "give three logs or more, of flights that differ: " + std::to_string(options.logs.size()) +
                              " cannot say by how much flights do");
  std::deque<log::FlightLog> logs;
  std::vector<LoopLog> named;
  LogNotes notes{"backwash vehicle fit", {}, {}, {}};
  log::KnownFlights known;
  each_readable(options.logs, notes, [&](const std::string& path) {
    progress("reading " + path);
    auto log = read_studied(path, notes);
    if (const auto other = another_vehicle(log, vehicle); !other.empty()) notes.column(path, other);
    if (const auto same = known.again(path, log::FlightMark(log)); !same.empty()) throw Failure(kBadData, same);
    logs.push_back(std::move(log));
    named.push_back({path, &logs.back()});
  });
  progress("fitting the loop");
  const auto fit = fit_those_that_tell(named, vehicle, notes);
  if (!options.out.empty() && fit.unexcited.empty())
    write_file(options.out, proposal(fit, options.vehicle, named), options.force,
               [&](const std::string& path) { return vehicle_refusal(path, options.vehicle); });
  options.json ? print(told_first(notes, to_json(fit, named, vehicle))) : print_text(fit, vehicle);
  if (!fit.unexcited.empty()) throw Failure(kBadData, unexcited_line(fit.unexcited));
  if (!options.out.empty() && !options.json) std::printf("proposal written to %s\n", options.out.c_str());
  return kOk;
}

}  // namespace

Verb vehicle_fit_verb(Command& group) {
  auto options = std::make_shared<VehicleFitOptions>();
  auto& command = group.add_subcommand("fit", "Gains, latency and attitude lag of three logs or more, with intervals");
  command.add_option("logs", options->logs, "flight logs: CSV, PX4 (.ulg), ArduPilot (.bin) or the daemon's (.mcap)")
      .required();
  command
      .add_option("--vehicle", options->vehicle,
                  "vehicle file or builtin:NAME: where to begin, and all that is not fitted")
      .required();
  command.add_option("--out", options->out, "the keys to write, TOML; nothing where a log does not excite one");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "overwrite --out");
  command.footer("Example:\n  backwash vehicle fit a.csv b.csv c.csv --vehicle own.vehicle.toml --out proposed.toml");
  return {&command, [options] { return fit_vehicle(*options); }};
}

}  // namespace backwash::services

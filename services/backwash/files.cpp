// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/files.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <stdexcept>

#include <toml++/toml.h>

#include "core/config/builtin_files.hpp"
#include "core/config/config.hpp"
#include "core/config/simulation_terms.hpp"
#include "core/files/read_file.hpp"
#include "core/log/kinds/recording.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/planner.hpp"

namespace backwash::services {

map::OccupancyGrid read_map(const std::string& path) {
  auto grid = map::load_map(path);
  if (grid) return std::move(*grid);
  using Kind = map::MapError::Kind;
  const auto kind = grid.error().kind;
  throw Failure(kind == Kind::not_found || kind == Kind::unknown_name ? kNoInput : kBadData, grid.error().message);
}

namespace {

template <typename T>
T read_configuration(tl::expected<T, config::ConfigError> value) {
  if (value) return std::move(*value);
  throw Failure(value.error().kind == config::ConfigError::Kind::not_found ? kNoInput : kConfiguration,
                value.error().message);
}

}  // namespace

namespace {

/// What a configuration says: a built-in one belongs to the program. Empty: it cannot be read.
std::string content_of(const std::string& path) {
  if (path.starts_with("builtin:")) return path;
  return files::read_file(path, files::kLargestConfiguration, "the path of a TOML file").value_or("");
}

std::map<std::string, std::string> contents;  // of configurations that were read, by path; empty: it changed meanwhile

template <typename Load>
auto read_and_remember(const std::string& path, const Load& load) {
  const std::string before = content_of(path);
  auto value = read_configuration(load(path));
  contents[path] = before == content_of(path) ? before : "";
  return value;
}

}  // namespace

std::string content_when_read(const std::string& path) {
  const auto found = contents.find(path);
  return found == contents.end() ? "" : found->second;
}

Model read_model(const std::string& path) { return read_and_remember(path, config::load_model); }
std::vector<SimulationTerm> read_simulation(const std::string& path) {
  return read_configuration(config::load_simulation(path));
}
Vehicle read_vehicle(const std::string& path, const std::vector<config::ChangedKey>& changed) {
  return read_and_remember(path, [&](const std::string& file) { return config::load_vehicle_with(file, changed); });
}

std::pair<Vehicle, Model> read_both(const std::string& vehicle_path, const std::string& model,
                                    std::optional<double> risk) {
  std::pair<Vehicle, Model> both;
  both.first = read_vehicle(vehicle_path);
  const std::string model_path = model_of(vehicle_path, model);
  both.second = read_model(model_path);
  // Names an unstable loop before anything else is asked of it.
  read_reachability(both.first, reach::Method::tight, reach::Loop::vehicle, vehicle_path);
  try {
    if (risk) both.second = plan::model_for(both.second, both.first, *risk);
  } catch (const std::invalid_argument& e) {
    throw Failure(kConfiguration, (both.second.extension.empty() ? vehicle_path : model_path) + ":1: " + e.what() +
                                      "; leave it out, or --risk");
  }
  return both;
}

log::FlightLog read_table(const std::string& path, const std::string& time_column, bool gaps) {
  auto table = log::read_csv(path, time_column, {}, gaps);
  if (table) return std::move(*table);
  if (table.error().kind == log::LogError::Kind::bad_data) {
    if (path.ends_with(".bwlog") || path.ends_with(".mcap"))
      throw Failure(kBadData,
                    path + ":1: is no table but a recording of backwashd; make one of it with backwash export --csv");
    if (const auto kind = log::recording_of(path); kind && (*kind)->form == log::RecordingKind::Form::autopilot)
      throw Failure(kBadData, path + ":1: is no table but an autopilot's log; make one of it with backwash import");
  }
  throw Failure(table.error().kind == log::LogError::Kind::not_found ? kNoInput : kBadData, table.error().message);
}

Option add_method(Command& command, reach::Method& target) {
  const std::vector<std::pair<std::string, reach::Method>> methods = {{"tight", reach::Method::tight},
                                                                      {"paper", reach::Method::paper}};
  return add_choice(command, "--method", target, methods, "tight (default): exact supports; paper: ellipsoids");
}

Option add_risk(Command& command, std::optional<double>& target) {
  return command
      .add_option("--risk", target,
                  "largest risk of touching in a flight, and in a minute at rest, in place of the worst case; of the "
                  "exact sets, no integrator, no extended model")
      .check(within(1e-6, 0.5));
}

std::string model_of(const std::string& vehicle, const std::string& model) {
  if (!model.empty()) return model;
  if (vehicle.starts_with("builtin:")) return vehicle;
  throw Failure(kUsage,
                "--vehicle " + vehicle + " has no model of its own; give the one that belongs to it with --model");
}

void check_output(const std::string& path, bool force) {
  if (path.empty()) return;
  std::error_code unknown;
  if (!force && std::filesystem::exists(path, unknown))
    throw Failure(kCannotCreate, path + ":1: exists already; give another name or --force");
  const auto folder = std::filesystem::absolute(path, unknown).parent_path();
  const bool folder_good = std::filesystem::is_directory(folder, unknown) && ::access(folder.c_str(), W_OK | X_OK) == 0;
  const bool there = std::filesystem::exists(path, unknown);
  const bool file_good = !std::filesystem::is_directory(path, unknown) && ::access(path.c_str(), W_OK) == 0;
  if (there ? !file_good : !folder_good)
    throw Failure(kCannotCreate, path + ":1: cannot be created; name a file in a folder that can be written");
}

void check_outputs(const std::vector<std::string>& paths, bool force) {
  std::set<std::filesystem::path> seen;
  for (const auto& path : paths) {
    check_output(path, force);
    std::error_code unknown;
    const auto whole = std::filesystem::weakly_canonical(std::filesystem::absolute(path, unknown), unknown);
    if (!path.empty() && !seen.insert(whole).second)
      throw Failure(kUsage, path + " is given for two outputs; give each a file of its own");
  }
}

namespace {

/// Lets `write` write a file beside `path`, which takes its place when it is whole and `refusal` is empty; a device is
/// written to itself.
void write_whole(const std::string& path, bool force, const std::function<bool(const std::string& to)>& write,
                 const ReadBack& refusal = {}) {
  check_output(path, force);
  std::error_code wrong;
  const bool device = std::filesystem::exists(path, wrong) && !std::filesystem::is_regular_file(path, wrong);
  const std::string name = device ? path : std::filesystem::weakly_canonical(path, wrong).string();  // a link stays
  const std::string part = ".part-" + std::to_string(::getpid());
  const auto beside = device ? std::filesystem::temp_directory_path() / part : std::filesystem::path(name + part);
  const std::string to = device && !refusal ? path : beside.string();
  wrong.clear();
  const bool whole = write(to);
  std::string why = whole && refusal ? refusal(to) : "";
  bool good = whole && why.empty();
  if (good && !device) std::filesystem::rename(to, name, wrong);
  if (good && device && to != path) good = static_cast<bool>(std::ofstream(path) << std::ifstream(to).rdbuf());
  std::error_code gone;
  if (to != path) std::filesystem::remove(to, gone);
  if (good && !wrong) return;
  if (why.empty()) throw Failure(kInputOutput, path + ":1: cannot be written to its end; free some space");
  if (why.starts_with(to)) why.erase(0, to.size());
  throw Failure(kBadData, path + (why.starts_with(":") ? "" : ":1: ") + why + "; it is not written");
}

}  // namespace

void write_stream(const std::string& path, bool force, const std::function<void(std::ostream&)>& write) {
  write_whole(path, force, [&](const std::string& to) {
    std::ofstream file(to, std::ios::binary);
    write(file);
    file.close();
    return file.good();
  });
}

void write_file(const std::string& path, const std::string& content, bool force, const ReadBack& refusal) {
  const auto write = [&](const std::string& to) {
    std::ofstream file(to, std::ios::binary);
    file << content;
    file.close();
    return file.good();
  };
  write_whole(path, force, write, refusal);
}

namespace {
constexpr const char* kUndetermined = "; the flights do not determine this number (see its interval)";
}  // namespace

std::string model_refusal(const std::string& path) {
  const auto model = config::load_model(path);
  const auto terms = config::load_simulation(path);
  const std::string why = !model ? model.error().message : !terms ? terms.error().message : "";
  return why.empty() ? "" : why + kUndetermined;
}

std::string vehicle_refusal(const std::string& path, const std::string& vehicle) {
  toml::table whole;
  if (vehicle.starts_with("builtin:")) {
    const std::string name = vehicle.substr(std::string("builtin:").size()) + ".vehicle.toml";
    whole = toml::parse(std::ranges::find(config::builtin_files(), name, &config::BuiltinFile::name)->text);
  } else {
    whole = toml::parse_file(vehicle);  // load_vehicle has accepted it
  }
  auto& controller = *whole["controller"].as_table();
  controller.erase("px4");
  const auto proposal = toml::parse_file(path);
  for (const auto& [key, value] : *proposal["controller"].as_table()) controller.insert_or_assign(key, value);
  const auto together = std::filesystem::path(path + ".whole");
  std::ofstream(together) << whole;
  const auto read = config::load_vehicle(together);
  std::filesystem::remove(together);
  if (read) return "";
  const auto key = read.error().message.find(" key '");  // its line is not the proposal's
  return path + ":1:" + read.error().message.substr(std::min(key, read.error().message.size())) + kUndetermined;
}

void write_log(const std::string& path, const log::FlightLog& log, bool force) {
  write_whole(path, force, [&](const std::string& to) { return log::write_csv(to, log, true).has_value(); });
}

reach::Reachability read_reachability(const Vehicle& vehicle, reach::Method method, reach::Loop loop,
                                      const std::string& vehicle_path) {
  try {
    return reach::Reachability(vehicle, method, loop);
  } catch (const std::invalid_argument& unstable) {
    throw Failure(kConfiguration,
                  vehicle_path + ":1: " + unstable.what() + "; choose gains, delay and lag of a stable loop");
  }
}

}  // namespace backwash::services

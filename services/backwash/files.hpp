// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <iosfwd>
#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "core/config/config.hpp"
#include "core/log/columns/flight_log.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/plan/world/world.hpp"
#include "core/reach/reach_tube.hpp"
#include "core/types/model.hpp"
#include "core/types/simulation_term.hpp"
#include "core/types/vehicle.hpp"
#include "services/backwash/verb.hpp"
#include "services/command_line/command_line.hpp"

namespace backwash::services {

/// Readers of a verb's inputs. Each throws Failure with the documented exit code: 66 for what does not exist, 65 for
/// bad data, 78 for a configuration that is not valid.
map::OccupancyGrid read_map(const std::string& path);
Model read_model(const std::string& path);
/// What an extended model adds to the simulation; nothing for others.
std::vector<SimulationTerm> read_simulation(const std::string& path);
Vehicle read_vehicle(const std::string& path, const std::vector<config::ChangedKey>& changed = {});
/// Both, with the model of a stated risk if there is one (plan::model_for). `model`: as model_of() takes it.
std::pair<Vehicle, Model> read_both(const std::string& vehicle_path, const std::string& model,
                                    std::optional<double> risk);
/// What a model or vehicle file held when it was read, the name of a built-in one; empty if it changed meanwhile, or
/// was not read.
std::string content_when_read(const std::string& path);
/// Reads a flight log; `gaps` as read_csv(). Failure: as read_csv(); of a recording, with the verb that makes a table.
log::FlightLog read_table(const std::string& path, const std::string& time_column, bool gaps = false);
/// What a reader of core/log gives; its error as Failure 66 or 65.
template <typename T>
T read_or_fail(tl::expected<T, log::LogError> read) {
  if (read) return std::move(*read);
  throw Failure(read.error().kind == log::LogError::Kind::not_found ? kNoInput : kBadData, read.error().message);
}

/// Adds `--method`: tight or paper.
Option add_method(Command& command, reach::Method& target);
/// --risk NUMBER.
Option add_risk(Command& command, std::optional<double>& target);

/// The model that a flight of this vehicle uses: the one given, or a built-in vehicle's own. Throws Failure 64 for
/// another file.
std::string model_of(const std::string& vehicle, const std::string& model);

/// Throws Failure 73 if the file exists and `force` is not given, or could not be made: asked before work is spent on
/// it. Without a name there is nothing to ask.
void check_output(const std::string& path, bool force);
/// The same of all that one call writes; throws Failure 64 where two of them are one file.
void check_outputs(const std::vector<std::string>& paths, bool force);
/// What the reader of a file says against it: PATH:LINE: what is wrong and what would be right. Empty: it was read.
using ReadBack = std::function<std::string(const std::string& path)>;
/// Writes a whole file; one that is replaced stays until the new one is complete. Throws Failure 73 (exists, cannot be
/// created) or 74 (cannot be written). A `refusal` is asked of the file that was written, before it takes its name:
/// throws Failure 65 with what it says.
void write_file(const std::string& path, const std::string& content, bool force, const ReadBack& refusal = {});
/// Why no program would read this model file, with key and value.
std::string model_refusal(const std::string& path);
/// Why no program would read `vehicle` with the table [controller] of the file in place of its own.
std::string vehicle_refusal(const std::string& path, const std::string& vehicle);
/// The same by what `write` puts onto a stream, which is not held in memory.
void write_stream(const std::string& path, bool force, const std::function<void(std::ostream&)>& write);
/// The same of a flight log.
void write_log(const std::string& path, const log::FlightLog& log, bool force);

/// Reach sets of a vehicle; an unstable loop is a configuration failure (78).
reach::Reachability read_reachability(const Vehicle& vehicle, reach::Method method, reach::Loop loop,
                                      const std::string& vehicle_path);

}  // namespace backwash::services

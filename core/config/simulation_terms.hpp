// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <toml++/toml.h>

#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/config/config.hpp"
#include "core/types/simulation_term.hpp"

/// What an extended model file says for the simulation alone.
namespace backwash::config {

/// Reads the `simulation` lists of a model file's `[[extension.term]]` ({ kind, value }, docs/model.md section 6, "In
/// the simulation"); none without an extension. The rest of the file is load_model's. Errors: not_found; invalid for an
/// entry of an unknown kind, with an unknown key, or with other numbers than its kind has.
tl::expected<std::vector<SimulationTerm>, ConfigError> load_simulation(const std::string& path);

/// An entry of `extension.term.simulation`: { kind, value }, eight significant digits, within what load_simulation
/// accepts.
toml::table simulation_table(const SimulationTerm& term);

}  // namespace backwash::config

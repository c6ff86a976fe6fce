// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <toml++/toml.h>

#include <optional>
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

/// Which number of a term load_simulation would refuse; nothing: none.
std::optional<std::string> why_unwritable(const SimulationTerm& term);

/// An entry of `extension.term.simulation`: { kind, value }, eight significant digits. Errors: throws
/// std::invalid_argument with why_unwritable().
toml::table simulation_table(const SimulationTerm& term);

}  // namespace backwash::config

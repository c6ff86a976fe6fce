// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace backwash::services {

/// The maps that --scenes arguments stand for: `builtin` is the five of the comparison, a folder its OctoMap files,
/// sorted by name. Throws Failure 66 for a folder without one.
std::vector<std::string> maps_of(const std::vector<std::string>& scenes);

/// The models of the vehicles: those given, else the built-in ones of the same names. Throws Failure 64 where they do
/// not fit.
std::vector<std::string> models_of(const std::vector<std::string>& vehicles, const std::vector<std::string>& models);

}  // namespace backwash::services

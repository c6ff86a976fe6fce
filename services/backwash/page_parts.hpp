// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace backwash::services {

/// The line that started this process, as a shell takes it again; the program by its name alone.
std::string own_command();
/// The text of vehicle and model, of files or built in; those that can be read.
std::vector<std::pair<std::string, std::string>> parameter_files(const std::string& vehicle, const std::string& model);

}  // namespace backwash::services

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

#include "services/backwash/json.hpp"

// Rows of JSON that one process prints and another one takes in place of logs: each says what it was made with, and
// ends with the hash of all before it.
namespace backwash::services {

/// What stands for a file in a row: its SHA-256; the name of what is built in; empty for none.
std::string file_identity(const std::string& path);

/// A row as a line, with its newline. Throws Failure 65 for a log whose name is no UTF-8.
std::string sealed(const Json& row);

/// Gives each row of the file to `take`, which may throw Failure with what is wrong, or std::out_of_range. `made`: what
/// each must name in `made`, as it was. Throws Failure: 66, or 65 with file and line for what is no such row, was
/// changed, or was made with something else, which it names; `verb` is what makes such rows.
void read_sealed(const std::string& path, const std::string& verb, const Json& made,
                 const std::function<void(const Json&)>& take);

}  // namespace backwash::services

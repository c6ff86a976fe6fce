// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace backwash::bench {

/// What keeps the bench from starting and is not its own fault: one line, with its exit code (docs/interfaces.md, "Exit
/// codes").
struct StartError : std::runtime_error {
  StartError(int exit_code, const std::string& what) : std::runtime_error(what), code(exit_code) {}
  int code;
};

constexpr int kUnavailable = 69, kSystem = 71, kCannotCreate = 73, kInputOutput = 74;

}  // namespace backwash::bench

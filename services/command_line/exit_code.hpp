// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace backwash {

/// How every program ends (docs/interfaces.md, "Exit codes"): the codes of sysexits.h, and 1 for what was flown and
/// failed.
enum ExitCode {
  kOk = 0,
  kFlightFailed = 1,
  kUsage = 64,
  kBadData = 65,
  kNoInput = 66,
  kUnavailable = 69,  ///< no plan, or a start or goal that cannot be used
  kSoftware = 70,
  kSystem = 71,
  kCannotCreate = 73,
  kInputOutput = 74,
  kConfiguration = 78,
  kInterrupted = 130,  ///< Ctrl-C: what was finished by then is told and written
};

/// What keeps a program from starting and is not its own fault: the exit code, and one line.
struct StartError : std::runtime_error {
  StartError(ExitCode exit_code, const std::string& what) : std::runtime_error(what), code(exit_code) {}
  ExitCode code;
};

}  // namespace backwash

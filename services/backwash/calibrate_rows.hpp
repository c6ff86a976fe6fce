// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "services/backwash/calibrate_input.hpp"

// What a calibration keeps of each log, a line of JSON each: made anywhere, calibrated in one place
// (docs/interfaces.md, "backwash calibrate").
namespace backwash::services {

/// Files that logs are cut into windows with, as on the command line.
struct CalibrateRowsOf {
  std::string vehicle, model;
  std::vector<std::string> maps;
};

/// The line of one log, with its newline.
std::string calibrate_row(const CalibratedLog& log, const CalibrateRowsOf& of);

/// Reads such lines. Throws Failure: 66, or 65 with file and line for what is no such line, was changed, or was made
/// with another program, vehicle or model, or in a map that is not one of these.
std::vector<CalibratedLog> read_calibrate_rows(const std::string& path, const CalibrateRowsOf& of);

}  // namespace backwash::services

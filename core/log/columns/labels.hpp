// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <tl/expected.hpp>

#include "core/log/columns/flight_log.hpp"

namespace backwash::log {

/// What a side file says of recordings: recording (recording_name) → label → number.
using Labels = std::map<std::string, std::map<std::string, double>>;

/// A file's name without its folder and endings: of a/b.csv.gz it is b. A column called `recording` has that.
std::string recording_name(const std::string& path);

/// Reads a table whose first column is `recording`, and every other one a label (docs/interfaces.md, "Labels"). A cell
/// that is empty or nan says nothing. Errors: those of read_csv, another first column, no label, a recording without a
/// name or with two rows.
tl::expected<Labels, LogError> read_labels(const std::string& path);

/// Adds each label as a column that is the same in all rows. `ceiling`, `day`, `surface_z_m` and `stood_z_m` take the
/// place of what an importer said; any other column that the log holds is measured. Error, at `path`: a label of its
/// name.
tl::expected<void, LogError> add_labels(FlightLog& log, const std::map<std::string, double>& labels,
                                        const std::string& path);

}  // namespace backwash::log

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "core/log/columns/import_columns.hpp"

namespace backwash::log {

/// The columns that a map names in our units, in their axes: rows with a place, t from 0, attitude as a quaternion.
/// Every other column takes its latest number before. What was left out, and how much, is in the notes: rows without a
/// place (empty, or a pose of zeros, as programs for motion capture write a body they lost), that repeat a stamp, from
/// before a column's first number, and what somebody drew on after the last sample. Errors: a column that is not there
/// or holds text; an attitude that is no unit quaternion.
tl::expected<FlightLog, LogError> in_their_axes(const ForeignTable& table, const std::string& path,
                                                const ColumnMap& map);

/// "12 of 800 rows (1.5 %) ": what begins a note.
std::string share_of_rows(std::size_t some, std::size_t all);

}  // namespace backwash::log

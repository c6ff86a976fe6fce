// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "core/config/config.hpp"
#include "core/log/columns/import_columns.hpp"

namespace backwash::services {

/// Reads a column map (docs/interfaces.md). Error: one line that names file, line, key and what would be right.
tl::expected<log::ColumnMap, config::ConfigError> read_column_map(const std::string& path);

/// A column map for a table, guessed from the names of its columns and confirmed by what physics says of the table;
/// with the sentences that remain as comments where nothing fits. `names`: of the columns, separated by commas, in
/// place of the table's own; empty: those. Error: as read_foreign_table; no time, no position.
tl::expected<std::string, log::LogError> proposed_column_map(const std::string& path, const std::string& names);

}  // namespace backwash::services

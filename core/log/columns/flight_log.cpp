// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/flight_log.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include "core/log/columns/import_columns.hpp"
#include "core/log/columns/log_columns.hpp"
#include "core/log/raw/log_file.hpp"

namespace backwash::log {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// Text whose lines end as ours do: old programs ended them by a carriage return alone.
std::string with_lines(std::string text) {
  if (text.find('\n') == text.npos) std::ranges::replace(text, '\r', '\n');
  return text;
}

/// What a table whose first line is `line` puts between its cells: spreadsheets of half the world write semicolons.
char separator_of(std::string_view line) {
  const auto at = line.find_first_of(";\t");
  return at == std::string_view::npos ? ',' : line[at];
}

std::vector<std::string_view> cells_of(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  while (true) {
    const auto comma = line.find(separator);
    cells.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

std::optional<double> finite_number(std::string_view cell) {
  if (cell.starts_with('+')) cell.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc{} || end != cell.data() + cell.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// A cell of a recording whose sensors have rates of their own.
std::optional<double> number_or_gap(std::string_view cell) {
  const auto same = [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; };
  if (cell.empty() || std::ranges::equal(cell, std::string_view("nan"), same))
    return std::numeric_limits<double>::quiet_NaN();
  return finite_number(cell);
}

tl::unexpected<LogError> bad(const std::string& path, std::size_t line, const std::string& what) {
  return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":" + std::to_string(line) + ": " + what});
}

/// The columns that the first line names.
tl::expected<std::vector<std::string>, LogError> read_names(std::istream& file, const std::string& path,
                                                            char& separator) {
  std::string text;
  if (!std::getline(file, text)) return bad(path, 1, "the file is empty; the first line must name the columns");
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";  // spreadsheets write it
  if (text.starts_with(kByteOrderMark)) text.erase(0, kByteOrderMark.size());
  std::vector<std::string> names;
  separator = separator_of(text);
  for (const auto cell : cells_of(text, separator)) {
    if (cell.empty())
      return bad(path, 1, "column " + std::to_string(names.size() + 1) + " has no name; name every column");
    names.emplace_back(cell);
  }
  std::set<std::string_view> seen;
  for (const auto& name : names)
    if (!seen.insert(name).second)
      return bad(path, 1, "column '" + name + "' is named twice; every name must be unique");
  return names;
}

/// The values below the first line by column, none of columns in `unread`.
tl::expected<std::vector<std::vector<double>>, LogError> read_rows(std::istream& file, const std::string& path,
                                                                   const std::vector<std::string>& names,
                                                                   const std::set<std::string>& unread, bool gaps,
                                                                   char separator) {
  std::vector<std::vector<double>> values(names.size());
  std::string text;
  for (std::size_t line = 2; std::getline(file, text); ++line) {
    if (trimmed(text).empty()) continue;
    const auto cells = cells_of(text, separator);
    if (cells.size() != names.size())
      return bad(path, line,
                 std::to_string(cells.size()) + " cells where the first line names " + std::to_string(names.size()) +
                     " columns; give one number per column");
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (unread.contains(names[i])) continue;
      const auto value = gaps ? number_or_gap(cells[i]) : finite_number(cells[i]);
      if (!value)
        return bad(
            path, line,
            "column '" + names[i] + "' holds '" + std::string(cells[i]) + "', which is not a finite number; give one");
      values[i].push_back(*value);
    }
  }
  return values;
}

void append(std::string& text, double value) {
  char digits[32];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

std::size_t gaps_in(const std::vector<double>& column) {
  return static_cast<std::size_t>(std::ranges::count_if(column, [](double x) { return std::isnan(x); }));
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

std::vector<std::string> leave_out_gaps(FlightLog& log) {
  const std::size_t rows = log.t_s.size();
  std::vector<std::string> told, gone, gappy;
  for (const auto& [name, column] : log.columns)
    if (2 * gaps_in(column) >= std::max<std::size_t>(rows, 1)) gone.push_back(name);
  for (const auto& name : gone) log.columns.erase(name);
  if (!gone.empty()) told.push_back("half of the rows and more are gaps; left out: " + listed(gone));
  std::vector<bool> good(rows);
  for (std::size_t i = 0; i < rows; ++i) good[i] = !std::isnan(log.t_s[i]);
  if (gaps_in(log.t_s) > 0) gappy.emplace_back("t_s");
  for (const auto& name : mappable_columns()) {
    if (!log.has(name) || gaps_in(log.column(name)) == 0) continue;
    gappy.push_back(name);
    for (std::size_t i = 0; i < rows; ++i) good[i] = good[i] && !std::isnan(log.column(name)[i]);
  }
  if (gappy.empty()) return told;
  const auto keep = [&](std::vector<double>& column) {
    std::size_t i = 0;
    std::erase_if(column, [&](double) { return !good[i++]; });
  };
  keep(log.t_s);
  for (auto& [name, column] : log.columns) keep(column);
  told.push_back(std::to_string(rows - log.t_s.size()) + " of " + std::to_string(rows) + " rows left out: gaps in " +
                 listed(gappy));
  return told;
}

tl::expected<std::string, LogError> read_log_file(const std::string& path, std::size_t most_bytes,
                                                  const std::string& wanted) {
  auto content = files::read_file(path, most_bytes, wanted);
  if (content) {
    auto plain = files::unzipped(std::move(*content), most_bytes);
    if (plain) return std::move(*plain);
    return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":1: " + plain.error()});
  }
  const bool too_large = content.error().kind == files::FileError::Kind::too_large;
  return tl::make_unexpected(LogError{too_large ? LogError::Kind::bad_data : LogError::Kind::not_found,
                                      path + ":1: " + content.error().message});
}

tl::expected<std::vector<std::string>, LogError> csv_names(const std::string& path) {
  auto content = read_log_file(path, files::kLargestTable, "a readable CSV file");
  if (!content) return tl::make_unexpected(content.error());
  std::istringstream file(with_lines(std::move(*content)));
  char separator = ',';
  return read_names(file, path, separator);
}

tl::expected<FlightLog, LogError> read_csv(const std::string& path, const std::string& time_column,
                                           const std::set<std::string>& unread, bool gaps) {
  auto content = read_log_file(path, files::kLargestTable, "a readable CSV file");
  if (!content) return tl::make_unexpected(content.error());
  std::istringstream file(with_lines(std::move(*content)));
  char separator = ',';
  const auto names = read_names(file, path, separator);
  if (!names) return tl::make_unexpected(names.error());
  if (!time_column.empty() && std::ranges::find(*names, time_column) == names->end())
    return bad(path, 1, "no column '" + time_column + "'; the first line must name it");
  auto values = read_rows(file, path, *names, unread, gaps, separator);
  if (!values) return tl::make_unexpected(values.error());
  FlightLog log;
  for (std::size_t i = 0; i < names->size(); ++i) {
    const std::string& name = (*names)[i];
    if (name == time_column) {
      log.t_s = std::move((*values)[i]);
    } else if (!unread.contains(name)) {
      log.columns.emplace(name, std::move((*values)[i]));
    }
  }
  return log;
}

tl::expected<void, LogError> write_csv(const std::string& path, const FlightLog& log, bool overwrite) {
  const auto cannot = [&](const std::string& why) {
    return tl::make_unexpected(LogError{LogError::Kind::cannot_create, path + ":1: " + why});
  };
  if (!overwrite && std::filesystem::exists(path)) return cannot("exists already; give another name or --force");
  std::string text = "t_s";
  for (const auto& [name, column] : log.columns) text += "," + name;
  text += '\n';
  for (std::size_t row = 0; row < log.t_s.size(); ++row) {
    append(text, log.t_s[row]);
    for (const auto& [name, column] : log.columns) {
      text += ',';
      append(text, column.at(row));
    }
    text += '\n';
  }
  std::ofstream file(path, std::ios::binary);
  if (!file) return cannot("cannot be created; name a file in a folder that can be written");
  file << text << std::flush;
  if (!file) return cannot("cannot be written to its end; free some space");
  return {};
}

}  // namespace backwash::log

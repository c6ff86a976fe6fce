// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/labels.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>
#include <utility>

#include "core/log/raw/log_file.hpp"

namespace backwash::log {
namespace {

constexpr const char* kRecording = "recording";

/// Of a recording as a whole, so that a side file may know better.
const std::set<std::string> kOfTheWhole = {"ceiling", "day", "surface_z_m", "stood_z_m"};

tl::unexpected<LogError> bad_label(const std::string& path, std::size_t line, const std::string& what) {
  return tl::make_unexpected(LogError{LogError::Kind::bad_data, path + ":" + std::to_string(line) + ": " + what});
}

/// The first cell of every row that is not blank below the first line, with the number of its line.
std::vector<std::pair<std::size_t, std::string>> first_cells(std::string content) {
  constexpr const char* kBlank = " \t\r";
  std::vector<std::pair<std::size_t, std::string>> cells;
  std::istringstream file(std::move(content));
  std::string text;
  std::getline(file, text);
  for (std::size_t line = 2; std::getline(file, text); ++line) {
    if (text.find_first_not_of(kBlank) == std::string::npos) continue;
    std::string cell = text.substr(0, text.find_first_of(",;\t"));
    const auto begin = std::min(cell.find_first_not_of(kBlank), cell.size());
    cell = cell.substr(begin, cell.find_last_not_of(kBlank) + 1 - begin);
    cells.emplace_back(line, std::move(cell));
  }
  return cells;
}

}  // namespace

std::string recording_name(const std::string& path) {
  auto stem = std::filesystem::path(path).stem();
  if (stem.extension() == ".csv") stem = stem.stem();
  return stem.string();
}

tl::expected<Labels, LogError> read_labels(const std::string& path) {
  const auto names = csv_names(path);
  if (!names) return tl::make_unexpected(names.error());
  if (names->front() != kRecording || names->size() < 2)
    return bad_label(path, 1,
                     "a table of labels has the columns recording and one label or more; name recording first");
  const auto numbers = read_csv(path, "", {kRecording}, true);
  if (!numbers) return tl::make_unexpected(numbers.error());
  auto content = read_log_file(path, files::kLargestTable, "a readable CSV file");
  if (!content) return tl::make_unexpected(content.error());
  const auto recordings = first_cells(std::move(*content));
  Labels labels;
  for (std::size_t row = 0; row < recordings.size(); ++row) {
    const auto& [line, recording] = recordings[row];
    if (recording.empty()) return bad_label(path, line, "a row without a recording; name its file");
    const auto [of, is_new] = labels.try_emplace(recording);
    if (!is_new) return bad_label(path, line, "recording '" + recording + "' has a row already; give one");
    for (const auto& [label, values] : numbers->columns)
      if (!std::isnan(values[row])) of->second.emplace(label, values[row]);
  }
  return labels;
}

tl::expected<void, LogError> add_labels(FlightLog& log, const std::map<std::string, double>& labels,
                                        const std::string& path) {
  for (const auto& [label, value] : labels) {
    if (label == "t_s" || (log.has(label) && !kOfTheWhole.contains(label)))
      return bad_label(path, 1, "the recording measures '" + label + "' itself; call the label something else");
    log.columns[label].assign(log.t_s.size(), value);
  }
  return {};
}

}  // namespace backwash::log

// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/fly/log_parts.hpp"

#include <charconv>
#include <filesystem>

#include "core/log/raw/raw_log.hpp"

namespace backwash::services {
namespace {

namespace fs = std::filesystem;

/// NAME and N of NAME-N; 1 of any other name.
std::pair<std::string, int> numbered(const std::string& stem) {
  const auto dash = stem.rfind('-');
  int number = 0;
  const char* end = stem.data() + stem.size();
  if (dash != stem.npos && std::from_chars(stem.data() + dash + 1, end, number).ptr == end && number > 1)
    return {stem.substr(0, dash), number};
  return {stem, 1};
}

}  // namespace

std::vector<std::string> with_later_parts(const std::vector<std::string>& logs) {
  if (logs.size() != 1) return logs;
  auto newest = log::part_of(logs.front());
  if (!newest) return logs;
  auto all = logs;
  const fs::path first = logs.front();
  auto [name, number] = numbered(first.stem().string());
  for (++number;; ++number) {
    fs::path next = first;
    next.replace_filename(name + "-" + std::to_string(number) + first.extension().string());
    std::error_code ignored;
    if (!fs::exists(next, ignored)) return all;
    const auto part = log::part_of(next.string());
    // Names of earlier starts may stand between.
    if (!part || part->log != newest->log || part->part != newest->part + 1) continue;
    newest = part;
    all.push_back(next.string());
  }
}

}  // namespace backwash::services

// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/spec_table.hpp"

#include <algorithm>
#include <cmath>

#include "core/files/read_file.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {

SpecTable SpecTable::open(const std::string& path) {
  const auto text = files::read_file(path, files::kLargestConfiguration, "a specification");
  if (!text) throw Failure(kNoInput, path + ":1: " + text.error().message);
  try {
    const auto root = std::make_shared<const toml::table>(toml::parse(*text, path));
    return {path, root, *root};
  } catch (const toml::parse_error& error) {
    throw Failure(kConfiguration, path + ":" + std::to_string(error.source().begin.line) + ": " +
                                      std::string(error.description()) + "; the file must be TOML");
  }
}

void SpecTable::wrong(const std::string& key, const std::string& what) const {
  const auto* node = table_.get(key);
  const auto line = std::max<toml::source_index>(1, (node ? node->source() : table_.source()).begin.line);
  throw Failure(kConfiguration, path_ + ":" + std::to_string(line) + ": " + key + " " + what);
}

void SpecTable::only(const std::vector<std::string_view>& known) const {
  for (const auto& [key, value] : table_) {
    if (std::ranges::find(known, key.str()) != known.end()) continue;
    std::string names;
    for (const auto name : known) names += (names.empty() ? "" : ", ") + std::string(name);
    wrong(std::string(key.str()), "is no key; known are " + names);
  }
}

SpecTable SpecTable::table(const std::string& key, const std::vector<std::string_view>& known) const {
  const auto* inner = table_[key].as_table();
  if (!inner) wrong(key, "must be a table, [" + key + "]");
  SpecTable found(path_, root_, *inner);
  found.only(known);
  return found;
}

std::string SpecTable::text(const std::string& key, const std::optional<std::string>& otherwise) const {
  if (!table_.contains(key) && otherwise) return *otherwise;
  const auto value = table_[key].value<std::string>();
  if (!value || value->empty()) wrong(key, "must be a text");
  return *value;
}

std::vector<std::string> SpecTable::texts(const std::string& key,
                                          const std::optional<std::vector<std::string>>& otherwise) const {
  if (!table_.contains(key) && otherwise) return *otherwise;
  if (table_[key].is_string()) return {text(key, std::nullopt)};
  const auto* list = table_[key].as_array();
  if (!list || list->empty()) wrong(key, "must be a list of texts");
  std::vector<std::string> all;
  for (const auto& entry : *list) {
    const auto value = entry.value<std::string>();
    if (!value || value->empty()) wrong(key, "must be a list of texts");
    all.push_back(*value);
  }
  return all;
}

double SpecTable::number(const std::string& key, double low, double high, std::optional<double> otherwise) const {
  if (!table_.contains(key) && otherwise) return *otherwise;
  const auto value = table_[key].value<double>();
  if (!value || !(*value >= low && *value <= high))
    wrong(key, "must be a number from " + to_text(low, low < 1 ? 3 : 0) + " to " + to_text(high, 0));
  return *value;
}

std::size_t SpecTable::count(const std::string& key, double low, double high,
                             std::optional<std::size_t> otherwise) const {
  if (!table_.contains(key) && otherwise) return *otherwise;
  const auto value = table_[key].value<std::int64_t>();
  if (!table_[key].is_integer() || !value || static_cast<double>(*value) < low || static_cast<double>(*value) > high)
    wrong(key, "must be a whole number from " + to_text(low, 0) + " to " + to_text(high, 0));
  return static_cast<std::size_t>(*value);
}

}  // namespace backwash::services

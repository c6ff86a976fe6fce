// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/flight_spec.hpp"

#include <toml++/toml.h>
#include <cmath>
#include <filesystem>
#include <initializer_list>

#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

[[noreturn]] void wrong(const std::string& path, const toml::source_region& where, const std::string& what) {
  throw Failure(kConfiguration, path + ":" + std::to_string(where.begin.line) + ": " + what);
}

void only(const std::string& path, const toml::table& table, std::initializer_list<std::string_view> known) {
  for (const auto& [key, value] : table) {
    if (std::find(known.begin(), known.end(), key.str()) != known.end()) continue;
    std::string names;
    for (const auto name : known) names += (names.empty() ? "" : ", ") + std::string(name);
    wrong(path, key.source(), "unknown key '" + std::string(key.str()) + "'; known are " + names);
  }
}

Vec3 point(const std::string& path, const toml::table& table, const char* key) {
  const auto* array = table[key].as_array();
  Vec3 p;
  bool ok = array != nullptr && array->size() == 3;
  for (std::size_t i = 0; ok && i < 3; ++i) {
    const auto value = array->get(i)->value<double>();
    ok = value && std::isfinite(*value);
    if (ok) p[static_cast<Eigen::Index>(i)] = *value;
  }
  if (!ok)
    wrong(path, array ? array->source() : table.source(),
          std::string(key) + " must be three numbers [x, y, z] in metres");
  return p;
}

}  // namespace

FlightSpec read_flight_spec(const std::string& path) {
  if (!std::filesystem::is_regular_file(path))
    throw Failure(kNoInput, path + ":1: cannot be opened; give a flight specification");
  toml::table file;
  try {
    file = toml::parse_file(path);
  } catch (const toml::parse_error& error) {
    wrong(path, error.source(), std::string(error.description()) + "; the file must be TOML");
  }
  only(path, file, {"start", "seed", "hover"});
  FlightSpec spec{point(path, file, "start"), 1, {}};
  if (file.contains("seed")) {
    const auto seed = file["seed"].value<std::int64_t>();
    if (!seed || *seed < 0) wrong(path, file["seed"].node()->source(), "seed must be an integer from 0");
    spec.seed = static_cast<std::uint64_t>(*seed);
  }
  const auto* hovers = file["hover"].as_array();
  if (hovers == nullptr || hovers->empty()) wrong(path, file.source(), "no [[hover]]; give at least one");
  for (const auto& node : *hovers) {
    const auto* hover = node.as_table();
    if (hover == nullptr) wrong(path, node.source(), "hover must be written as tables, [[hover]]");
    only(path, *hover, {"p", "dwell"});
    const auto dwell = (*hover)["dwell"].value<double>();
    if (!dwell || !(*dwell > 0 && *dwell <= 3600))
      wrong(path, hover->source(), "dwell must be a time from 0 to 3600 s");
    spec.hovers.push_back({point(path, *hover, "p"), *dwell});
  }
  return spec;
}

}  // namespace backwash::services

// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/fly/flight_spec.hpp"

#include <toml++/toml.h>
#include <cmath>
#include <initializer_list>

#include "core/files/read_file.hpp"
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

double number(const std::string& path, const toml::table& table, const char* key, double low, double high,
              std::optional<double> otherwise) {
  if (!table.contains(key) && otherwise) return *otherwise;
  const auto value = table[key].value<double>();
  if (!value || !(*value >= low && *value <= high)) {
    const auto* node = table.get(key);
    wrong(path, node ? node->source() : table.source(),
          std::string(key) + " must be a number from " + to_text(low, 0) + " to " + to_text(high, 0));
  }
  return *value;
}

std::vector<sim::HoverFlight::Hover> listed_hovers(const std::string& path, const toml::array& hovers) {
  std::vector<sim::HoverFlight::Hover> list;
  for (const auto& node : hovers) {
    const auto* hover = node.as_table();
    if (hover == nullptr) wrong(path, node.source(), "hover must be written as tables, [[hover]]");
    only(path, *hover, {"p", "dwell"});
    const auto dwell = (*hover)["dwell"].value<double>();
    if (!dwell || !(*dwell > 0 && *dwell <= 3600))
      wrong(path, hover->source(), "dwell must be a time above 0 and up to 3600 s");
    list.push_back({point(path, *hover, "p"), *dwell});
  }
  return list;
}

sim::HoverGrid hover_grid(const std::string& path, const toml::table& table) {
  only(path, table, {"low", "high", "count", "jitter", "dwell"});
  sim::HoverGrid grid{point(path, table, "low"), point(path, table, "high"), {}, 0, 0};
  const Vec3 count = point(path, table, "count");
  if ((count.array() < 1).any() || (count.array() > 100).any() || count != count.array().round().matrix())
    wrong(path, table.get("count")->source(), "count must be three integers from 1 to 100");
  grid.count = count.cast<int>();
  grid.jitter = number(path, table, "jitter", 0, 1, 0.0);
  grid.dwell_s = number(path, table, "dwell", 1, 3600, std::nullopt);
  return grid;
}

}  // namespace

sim::HoverFlight read_flight_spec(const std::string& path, std::optional<std::uint64_t> given_seed) {
  const auto text = files::read_file(path, files::kLargestConfiguration, "a flight specification");
  if (!text) throw Failure(kNoInput, path + ":1: " + text.error().message);
  toml::table file;
  try {
    file = toml::parse(*text, path);
  } catch (const toml::parse_error& error) {
    wrong(path, error.source(), std::string(error.description()) + "; the file must be TOML");
  }
  only(path, file, {"start", "seed", "strength_sd", "hover", "grid"});
  sim::HoverFlight spec{point(path, file, "start"), 1, number(path, file, "strength_sd", 0, 2, 0.0), {}};
  if (file.contains("seed")) {
    const auto seed = file["seed"].value<std::int64_t>();
    if (!seed || *seed < 0) wrong(path, file["seed"].node()->source(), "seed must be an integer from 0");
    spec.seed = static_cast<std::uint64_t>(*seed);
  }
  spec.seed = given_seed.value_or(spec.seed);
  const auto* hovers = file["hover"].as_array();
  const auto* grid = file["grid"].as_table();
  if ((hovers == nullptr || hovers->empty()) == (grid == nullptr))
    wrong(path, file.source(), "give either [[hover]], at least one, or [grid]");
  spec.hovers = grid ? sim::hover_points(hover_grid(path, *grid), spec.seed) : listed_hovers(path, *hovers);
  return spec;
}

}  // namespace backwash::services

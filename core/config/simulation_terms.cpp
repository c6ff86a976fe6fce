// SPDX-License-Identifier: BSD-3-Clause
#include "core/config/simulation_terms.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/config/model_table.hpp"
#include "core/config/strict_table.hpp"

namespace backwash::config {
namespace {

using Kind = SimulationTerm::Kind;

constexpr Range kPush{-10, 10};      // m/s², 1/s
constexpr Range kLn{-10, 10};        // of a factor
constexpr Range kLength{0.01, 10};   // m, exponents
constexpr Range kTime{0.1, 1000};    // s
constexpr Range kShare{-0.9, 0.9};   // of the thrust
constexpr Range kPart{0, 1};         // of readings
constexpr Range kLag{0, 1};          // s
constexpr Range kDelay{-0.3, 0.3};   // s
constexpr Range kVolts{0.1, 1000};   // V
constexpr Range kCelsius{-50, 150};  // °C
constexpr Range kAmplitude{0, 100};  // m/s²
constexpr Range kOffset{-2, 2};      // m
constexpr Range kCourse{-1, 1};      // V/s, °C/s
constexpr Range kSag{-10, 10};       // relative thrust per relative voltage
constexpr Range kKurtosis{0, 3};     // ln
constexpr Range kShareOfMap{0, 2};   // of ln Σ

struct TermKind {
  std::string_view name;
  std::variant<Law, Kind> kind;
  std::vector<Range> value;
};

/// Another kind: its line here, in SimulationTerm and where core/sim computes it. The laws are in core/types/law.hpp.
std::vector<TermKind> simulations_own() {
  return {
      {"push_of_heading", Kind::push_of_heading, {kPush, kPush}},
      {"ln_variance_with_time", Kind::ln_variance_with_time, {kLn, kTime}},
      {"variance_elsewhere", Kind::variance_elsewhere, {kShareOfMap, kOffset, kOffset}},
      {"kurtosis", Kind::kurtosis, {kKurtosis}},
      {"thrust_share", Kind::thrust_share, {kShare}},
      {"thrust_slope", Kind::thrust_slope, {kShare}},
      {"thrust_with_voltage", Kind::thrust_with_voltage, {kSag, kVolts, kVolts, kVolts, kCourse}},
      {"thrust_lag", Kind::thrust_lag, {kLag}},
      {"setpoint_delay", Kind::setpoint_delay, {kDelay}},
      {"attitude_lag", Kind::attitude_lag, {kDelay}},
      {"sensor_drift_with_time", Kind::sensor_drift_with_time, {kPush, kPush, kPush, kPush, kPush, kPush}},
      {"sensor_drift_with_temperature",
       Kind::sensor_drift_with_temperature,
       {kPush, kPush, kPush, kPush, kPush, kPush, kCelsius, kCourse}},
      {"sensor_lines", Kind::sensor_lines, {kAmplitude, kAmplitude, kAmplitude, kAmplitude, kAmplitude}},
      {"rotor_needs", Kind::rotor_needs, {kLn, kLn, kLn, kLn}},
      {"rotor_reading", Kind::rotor_reading, {kLn, kLn, kLn, kLn}},
      {"rotor_dropout", Kind::rotor_dropout, {kPart, kPart, kPart, kPart}},
  };
}

const std::vector<TermKind>& kinds() {
  static const std::vector<TermKind> all = [] {
    std::vector<TermKind> made = simulations_own();
    for (const LawEntry& law : kLaws) {
      made.push_back({law.name, law.law, std::vector<Range>(law.values, law.of_variance ? kLn : kPush)});
      if (law.scaled) made.back().value.push_back(kLength);
    }
    return made;
  }();
  return all;
}

std::string number(double x) {
  std::ostringstream text;
  text << x;
  return text.str();
}

std::string names() {
  std::string all;
  for (const auto& k : kinds()) all += (all.empty() ? "" : ", ") + std::string(k.name);
  return all;
}

/// An entry, or what is wrong with it.
tl::expected<SimulationTerm, std::string> read_term(const toml::node& node) {
  const auto wrong = [](std::string what) { return tl::unexpected(std::move(what)); };
  const auto* table = node.as_table();
  if (!table) return wrong("needs tables { kind, value }");
  const auto name = (*table)["kind"].value_or(std::string());
  const auto kind = std::ranges::find_if(kinds(), [&](const auto& k) { return k.name == name; });
  if (kind == kinds().end()) return wrong("kind needs one of " + names());
  for (const auto& [key, value] : *table)
    if (key != "kind" && key != "value")
      return wrong("has an unknown key '" + std::string(key.str()) + "'; known are kind, value");
  const auto* list = (*table)["value"].as_array();
  if (!list || list->size() != kind->value.size())
    return wrong(name + ": value needs a list of " + std::to_string(kind->value.size()));
  SimulationTerm term{kind->kind, {}};
  for (std::size_t i = 0; i < kind->value.size(); ++i) {
    const auto* at = list->get(i);
    const auto x = at->is_number() ? at->value<double>() : std::nullopt;
    const Range& range = kind->value[i];
    if (!x || !(*x >= range.low) || !(*x <= range.high))
      return wrong(name + ": number " + std::to_string(i + 1) + " of value needs to be in [" + number(range.low) +
                   ", " + number(range.high) + "]");
    term.value.push_back(*x);
  }
  return term;
}

}  // namespace

tl::expected<std::vector<SimulationTerm>, ConfigError> load_simulation(const std::string& path) {
  const auto file = StrictTable::open(path, ".model.toml");
  if (!file) return tl::unexpected(file.error());
  std::vector<SimulationTerm> terms;
  for (const toml::node* node : file->nodes("extension.term", "simulation")) {
    auto term = read_term(*node);
    if (!term) return tl::unexpected(file->error_at(*node, "extension.term.simulation", term.error()));
    terms.push_back(std::move(*term));
  }
  return terms;
}

toml::table simulation_table(const SimulationTerm& term) {
  const auto kind = std::ranges::find(kinds(), term.kind, &TermKind::kind);
  toml::array value;
  for (std::size_t i = 0; i < kind->value.size(); ++i) {
    const double x = i < term.value.size() && std::isfinite(term.value[i]) ? term.value[i] : 0.0;
    value.push_back(rounded(std::clamp(x, kind->value[i].low, kind->value[i].high), 8));
  }
  toml::table table{{"kind", kind->name}, {"value", value}};
  table.is_inline(true);
  return table;
}

}  // namespace backwash::config

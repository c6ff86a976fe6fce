// SPDX-License-Identifier: BSD-3-Clause
#include "core/config/simulation_terms.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "core/config/model_table.hpp"
#include "core/config/strict_table.hpp"

namespace backwash::config {
namespace {

struct TermKind {
  std::string_view name;
  std::variant<Law, SimulationTerm::Kind> kind;
  std::vector<TermRange> value;
};

const std::vector<TermKind>& kinds() {
  static const std::vector<TermKind> all = [] {
    std::vector<TermKind> made;
    made.reserve(std::size(kSimulationKinds) + std::size(kLaws));
    for (const SimulationKind& own : kSimulationKinds)
      made.push_back({own.name, own.kind, {own.numbers.begin(), own.numbers.end()}});
    for (const LawEntry& law : kLaws) {
      made.push_back({law.name, law.law, std::vector(law.values, law.of_variance ? terms::kLn : terms::kPush)});
      if (law.scaled) made.back().value.push_back(terms::kScale);
    }
    return made;
  }();
  return all;
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
  for (const auto& at : *list)
    term.value.push_back(at.is_number() ? *at.value<double>() : std::numeric_limits<double>::quiet_NaN());
  if (auto why = why_unwritable(term)) return wrong(std::move(*why));
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

std::optional<std::string> why_unwritable(const SimulationTerm& term) {
  const auto kind = std::ranges::find(kinds(), term.kind, &TermKind::kind);
  const std::string name(kind->name);
  if (term.value.size() != kind->value.size())
    return name + ": value needs a list of " + std::to_string(kind->value.size());
  for (std::size_t i = 0; i < term.value.size(); ++i) {
    const TermRange& range = kind->value[i];
    if (auto why = out_of_range(name + ": number " + std::to_string(i + 1) + " of value", term.value[i], range.least,
                                range.most))
      return why;
  }
  return std::nullopt;
}

toml::table simulation_table(const SimulationTerm& term) {
  if (const auto why = why_unwritable(term)) throw std::invalid_argument(*why);
  const auto kind = std::ranges::find(kinds(), term.kind, &TermKind::kind);
  toml::array value;
  for (const double x : term.value) value.push_back(rounded(x, 8));
  toml::table table{{"kind", kind->name}, {"value", value}};
  table.is_inline(true);
  return table;
}

}  // namespace backwash::config

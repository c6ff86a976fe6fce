// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/study_terms.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <sstream>

namespace backwash::services {

std::vector<study::ExtensionTerm> read_terms(const std::string& path) {
  std::vector<study::ExtensionTerm> terms;
  if (path.starts_with("builtin:")) return terms;
  const auto file = toml::parse_file(path);  // load_model has accepted it
  const auto* list = file.at_path("extension.term").as_array();
  if (!list) return terms;
  for (const auto& entry : *list) {
    const auto* table = entry.as_table();
    if (!table) continue;
    study::ExtensionTerm term{(*table)["cause"].value_or(std::string()),
                              (*table)["form"].value_or(std::string()),
                              {(*table)["scale"].value_or(0.0)},
                              {}};
    if (const auto* offset = (*table)["offset_m"].as_array(); offset && offset->size() == 2)
      term.scale.offset_W = {(*offset)[0].value_or(0.0), (*offset)[1].value_or(0.0), 0};
    if (const auto* theta = (*table)["theta"].as_array())
      for (const auto& value : *theta) term.theta.push_back(value.value_or(0.0));
    term.gain = (*table)["held_out_nats"].value_or(0.0);
    term.flights = static_cast<std::size_t>(std::max<std::int64_t>(0, (*table)["flights"].value_or(std::int64_t{0})));
    for (const auto& [key, numbers] : {std::pair{"anchor", &term.scale.anchor}, {"beside", &term.beside}})
      if (const auto* list_of = (*table)[key].as_array())
        for (const auto& value : *list_of) numbers->push_back(value.value_or(0.0));
    terms.push_back(std::move(term));
  }
  return terms;
}

std::string earlier_terms(const std::string& path) {
  if (path.starts_with("builtin:")) return "";
  const auto file = toml::parse_file(path);  // load_model has accepted it
  const auto* list = file.at_path("extension.term").as_array();
  if (!list) return "";
  std::ostringstream text;
  text << toml::toml_formatter{toml::table{{"extension", toml::table{{"term", *list}}}}};
  return text.str();
}

}  // namespace backwash::services

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "core/config/model_table.hpp"
#include "core/config/strict_table.hpp"

namespace backwash::config {
namespace {

constexpr Range kVariance{0, 100};       // (m/s²)²
constexpr Range kAmplitude{0, 1e4};      // (m/s²)²/m², of what decays to a half within 0.12 m and more
constexpr Range kLength{0, 20, true};    // m
constexpr Range kAngle{0, 1.571, true};  // rad, up to π/2 as people round it
constexpr Range kDecay{0, 1000, true};   // 1/m²
constexpr double kMost = 10;             // of an effect's numbers
constexpr double kLeastScale = 0.01;     // m

std::vector<Key> model_keys(Model& m) {
  using enum Key::Presence;
  // clang-format off
  return {
      {"base.horizontal", &m.base.horizontal, kVariance, required, "(m/s²)²", "Σ_0", "hover 2 m and more from everything"},
      {"base.vertical", &m.base.vertical, kVariance, required, "(m/s²)²", "along z"},
      {"ground.theta_max", &m.ground.theta_max, kAngle, required, "rad", "gate θ̄_g"},
      {"ground.l_max", &m.ground.l_max, kLength, required, "m", "gate l̄_g: where the floor is not felt any more"},
      {"ground.l_footprint_max", &m.ground.l_footprint_max, kLength, optional, "m", "gate l̄_u of the rotors' footprint"},
      {"ground.r0", &m.ground.r0, {0, 5, true}, optional, "m", "footprint; the vehicle's `body.diagonal_radius` takes its place"},
      {"ground.lambda.horizontal", &m.ground.lambda.horizontal, kVariance, required, "(m/s²)²", "λ_g", "hovers at several heights over a floor"},
      {"ground.lambda.vertical", &m.ground.lambda.vertical, kVariance, required, "(m/s²)²", "along z"},
      {"ground.k1.horizontal", &m.ground.k1.horizontal, kAmplitude, required, "(m/s²)²/m²", "k_g1"},
      {"ground.k1.vertical", &m.ground.k1.vertical, kAmplitude, required, "(m/s²)²/m²", "along z"},
      {"ground.k2", &m.ground.k2, kDecay, required, "1/m²", "k_g2"},
      {"corner.phi_max", &m.corner.phi_max, kAngle, required, "rad", "gate φ̄_c"},
      {"corner.l_max", &m.corner.l_max, kLength, required, "m", "gate l̄_c"},
      {"corner.lambda.normal", &m.corner.lambda.normal, kVariance, required, "(m/s²)²", "λ_c across the wall", "low hovers next to the foot of a wall"},
      {"corner.lambda.tangential", &m.corner.lambda.tangential, kVariance, required, "(m/s²)²", "along it"},
      {"corner.lambda.vertical", &m.corner.lambda.vertical, kVariance, required, "(m/s²)²", "vertical"},
      {"wall.theta_min", &m.wall.theta_min, kAngle, required, "rad", "gate θ_w"},
      {"wall.l_max", &m.wall.l_max, kLength, required, "m", "gate l̄_w"},
      {"wall.k1.normal", &m.wall.k1.normal, kAmplitude, required, "(m/s²)²/m²", "k_w1 across the wall", "hovers at several distances from a wall"},
      {"wall.k1.tangential", &m.wall.k1.tangential, kAmplitude, required, "(m/s²)²/m²", "along it"},
      {"wall.k1.vertical", &m.wall.k1.vertical, kAmplitude, required, "(m/s²)²/m²", "vertical"},
      {"wall.k2", &m.wall.k2, kDecay, required, "1/m²", "k_w2"},
      {"bound.kappa", &m.bound.kappa, {0, 10}, optional, "", "standard deviations in the bound", "chosen"},
      {"bound.mean.horizontal", &m.bound.mean_horizontal, {0, 10}, with_parent, "m/s²", "largest steady push", "mean of w over long hovers, with set-points in the log", "0"},
      {"bound.mean.vertical", &m.bound.mean_vertical, {0, 10}, with_parent, "m/s²", "along z", {}, "0"},
      {"bound.tau_w", &m.bound.tau_w, {0, 10, true}, optional, "s", "correlation time, for the chance mode, `--air model` and `study`", "spectrum of w (`calibrate`)"},
      read_elsewhere("confidence", "intervals that `calibrate` wrote, by key"),
      read_elsewhere("provenance", "sources that `calibrate` wrote; not read"),
      read_elsewhere("extension", "what `study --out` added, below"),
  };
  // clang-format on
}

std::string effect_names() {
  std::string names;
  for (const LawEntry& law : kLaws) names += (names.empty() ? "" : ", ") + std::string(law.name);
  return names;
}

/// `count` numbers of an effect's list, each of a magnitude that a vehicle may meet.
std::optional<Vec3> numbers(const toml::table& table, const char* key, std::size_t count, double least) {
  const auto* list = table[key].as_array();
  if (!list || list->size() != count) return std::nullopt;
  Vec3 v = Vec3::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const auto number = list->get(i)->value<double>();
    if (!number || !(*number >= least) || !(*number <= kMost)) return std::nullopt;
    v[static_cast<Eigen::Index>(i)] = *number;
  }
  return v;
}

/// An effect, or what is wrong with it.
tl::expected<ModelEffect, std::string> read_effect(const toml::node& node) {
  const auto wrong = [](std::string what) { return tl::unexpected(std::move(what)); };
  const auto* table = node.as_table();
  if (!table) return wrong("needs tables { kind, value, error }");
  const auto name = (*table)["kind"].value_or(std::string());
  const auto law = std::ranges::find(kLaws, name, &LawEntry::name);
  if (law == kLaws.end()) return wrong("kind needs one of " + effect_names());
  for (const auto& [key, value] : *table)
    if (key != "kind" && key != "value" && key != "error" && key != "scale")
      return wrong("has an unknown key '" + std::string(key.str()) + "'; known are kind, value, error, scale");
  ModelEffect effect{.kind = law->law};
  const std::string count = std::to_string(law->values);
  const auto value = numbers(*table, "value", law->values, -10);
  if (!value) return wrong(name + ": value needs a list of " + count + " in [-10, 10]");
  effect.value = *value;
  const auto error = numbers(*table, "error", law->values, 0);
  if (!error) return wrong(name + ": error needs a list of " + count + " in [0, 10]");
  effect.error = *error;
  if (law->scaled) effect.scale = (*table)["scale"].value_or(0.0);
  if (law->scaled && !(effect.scale >= kLeastScale && effect.scale <= kMost))
    return wrong(name + ": scale needs a number in [0.01, 10]");
  return effect;
}

}  // namespace

std::string model_file_keys() {
  Model model;
  return markdown(model_keys(model));
}

tl::expected<Model, ConfigError> load_model(const std::string& path) {
  const auto file = StrictTable::open(path, ".model.toml");
  if (!file) return tl::unexpected(file.error());
  Model model;
  if (auto read = file->read(model_keys(model)); !read) return tl::unexpected(read.error());
  for (const toml::node* effect : file->nodes("extension.term", "effect")) {
    auto read = read_effect(*effect);
    if (!read) return tl::unexpected(file->error_at(*effect, "extension.term.effect", read.error()));
    model.extension.push_back(*read);
  }
  return model;
}

tl::expected<std::array<double, 2>, ConfigError> load_tau_interval(const std::string& path) {
  const auto model = load_model(path);
  if (!model) return tl::unexpected(model.error());
  const auto file = StrictTable::open(path, ".model.toml");
  if (!file) return tl::unexpected(file.error());
  const auto ends = file->numbers("confidence", "bound.tau_w");
  if (!ends) return std::array{model->bound.tau_w, model->bound.tau_w};
  if (ends->size() == 2 && ends->front() > 0 && ends->back() >= ends->front() && std::isfinite(ends->back()))
    return std::array{ends->front(), ends->back()};
  return tl::unexpected(file->error("confidence", "needs \"bound.tau_w\" = two rising times above 0, in s"));
}

double rounded(double value, int digits) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return std::strtod(text.data(), nullptr);
}

toml::table model_table(const Model& model) {
  Model copy = model;
  toml::table whole;
  for (const Key& key : model_keys(copy)) {
    const auto* const number = std::get_if<double*>(&key.target);
    if (!number) continue;
    toml::table* table = &whole;
    std::string_view rest = key.path;
    for (auto dot = rest.find('.'); dot != std::string_view::npos; dot = rest.find('.')) {
      auto& inner = *table->emplace<toml::table>(rest.substr(0, dot)).first->second.as_table();
      inner.is_inline(table != &whole);
      table = &inner;
      rest.remove_prefix(dot + 1);
    }
    table->insert_or_assign(rest, rounded(**number, 6));
  }
  return whole;
}

std::optional<std::string> out_of_range(const std::string& what, double x, double least, double most) {
  if (x >= least && x <= most) return std::nullopt;
  std::ostringstream text;
  text << what << " is " << x << ", wanted in [" << least << ", " << most << "]";
  return text.str();
}

std::optional<std::string> why_unwritable(const ModelEffect& effect) {
  const LawEntry& law = entry(effect.kind);
  const std::string name(law.name);
  for (std::size_t i = 0; i < law.values; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const std::string number = ": number " + std::to_string(i + 1) + " of ";
    if (auto why = out_of_range(name + number + "value", effect.value[k], -kMost, kMost)) return why;
    if (auto why = out_of_range(name + number + "error", effect.error[k], 0, kMost)) return why;
  }
  return law.scaled ? out_of_range(name + ": scale", effect.scale, kLeastScale, kMost) : std::nullopt;
}

toml::table effect_table(const ModelEffect& effect) {
  if (const auto why = why_unwritable(effect)) throw std::invalid_argument(*why);
  const LawEntry& law = entry(effect.kind);
  const auto list = [&](const Vec3& v) {
    toml::array numbers;
    for (std::size_t i = 0; i < law.values; ++i) numbers.push_back(rounded(v[static_cast<Eigen::Index>(i)], 8));
    return numbers;
  };
  toml::table table{{"kind", law.name}, {"value", list(effect.value)}, {"error", list(effect.error)}};
  if (law.scaled) table.insert("scale", rounded(effect.scale, 8));
  table.is_inline(true);
  return table;
}

namespace {

/// The library prints 17 digits of each number; here the fewest that are read as the same one.
std::string with_short_numbers(const std::string& text) {
  std::string result;
  char quote = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find_first_not_of("+-.0123456789e", at), text.size());
    const bool word = at > 0 && (std::isalnum(static_cast<unsigned char>(text[at - 1])) || text[at - 1] == '_');
    const std::string token = text.substr(at, end - at);
    if (quote == 0 && !word && token.find('.') != token.npos) {
      std::array<char, 40> number{};
      char* const last =
          std::to_chars(number.data(), number.data() + number.size(), std::strtod(token.c_str(), nullptr)).ptr;
      std::string shortest(number.data(), last);
      if (shortest.find_first_of(".e") == shortest.npos) shortest += ".0";
      result += shortest;
      at = end;
      continue;
    }
    const char c = text[at++];
    result += c;
    if (quote == '"' && c == '\\' && at < text.size())
      result += text[at++];
    else if (quote == 0 && (c == '"' || c == '\''))
      quote = c;
    else if (c == quote)
      quote = 0;
  }
  return result;
}

}  // namespace

std::string text_of(const toml::table& tables, const std::vector<std::string>& order) {
  std::ostringstream text;
  for (const auto& name : order)
    if (const auto* table = tables[name].as_table())
      text << toml::toml_formatter{toml::table{{name, *table}}} << "\n\n";
  return with_short_numbers(text.str());
}

}  // namespace backwash::config

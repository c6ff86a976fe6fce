// SPDX-License-Identifier: BSD-3-Clause
#include "core/config/strict_table.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <set>
#include <sstream>

#include "core/config/builtin_files.hpp"
#include "core/config/file_hash.hpp"
#include "core/files/read_file.hpp"

namespace backwash::config {
namespace {

constexpr std::string_view kBuiltin = "builtin:";

tl::expected<std::string, ConfigError> builtin_contents(const std::string& path, std::string_view suffix) {
  std::string wanted = path.substr(kBuiltin.size());
  wanted += suffix;
  std::ostringstream message;
  message << path << ": no such built-in file; there are";
  for (const BuiltinFile& file : builtin_files()) {
    if (file.name == wanted) return std::string(file.text);
    if (file.name.ends_with(suffix))
      message << " " << kBuiltin << file.name.substr(0, file.name.size() - suffix.size());
  }
  return tl::unexpected(ConfigError{ConfigError::Kind::not_found, message.str()});
}

tl::expected<std::string, ConfigError> contents(const std::string& path, std::string_view suffix) {
  if (path.starts_with(kBuiltin)) return builtin_contents(path, suffix);
  auto text = files::read_file(path, files::kLargestConfiguration, "the path of a TOML file");
  if (text) return std::move(*text);
  const bool too_large = text.error().kind == files::FileError::Kind::too_large;
  return tl::unexpected(ConfigError{too_large ? ConfigError::Kind::invalid : ConfigError::Kind::not_found,
                                    path + ": " + text.error().message});
}

std::string range_text(const Range& range) {
  std::ostringstream out;
  out << "needs a number in " << (range.above_low ? "(" : "[") << range.low << ", " << range.high << "]";
  return out.str();
}

/// The value on one line, shortened.
std::string value_text(const toml::node& node) {
  if (node.is_table()) return "{…}";
  std::ostringstream out;
  // As people write it: TOML's own formatter prints 8.8 with 17 digits.
  if (const auto* number = node.as_floating_point())
    out << std::setprecision(15) << number->get();
  else
    out << toml::node_view<const toml::node>{node};
  std::string text = out.str().substr(0, 60);
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < ' '; }, ' ');
  return text;
}

std::string_view parent_of(std::string_view path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string_view::npos ? std::string_view{} : path.substr(0, dot);
}

/// Names that may follow `prefix` ("" or "a."), in the order in which they are described.
std::string names_below(std::string_view prefix, std::span<const Key> keys) {
  std::string list;
  std::set<std::string_view> seen;
  for (const Key& key : keys) {
    if (!key.path.starts_with(prefix)) continue;
    const std::string_view name = key.path.substr(prefix.size(), key.path.find('.', prefix.size()) - prefix.size());
    if (seen.insert(name).second) list += (list.empty() ? "" : ", ") + std::string(name);
  }
  return list;
}

template <typename... Of>
struct Each : Of... {
  using Of::operator()...;
};

std::string number_text(double value) {
  std::ostringstream out;
  out << std::setprecision(10) << value;
  return out.str();
}

std::string word(const std::string& text) { return text.empty() ? "none" : "`" + text + "`"; }

/// What counts where the key is not in the file.
std::string default_text(const Key& key) {
  if (key.presence == Key::Presence::required) return "needed";
  if (!key.absent.empty()) return std::string(key.absent);
  if (key.presence == Key::Presence::with_parent) return "with its table";
  return std::visit(Each{[](std::monostate) { return std::string(); }, [](const double* x) { return number_text(*x); },
                         [](const int* x) { return std::to_string(*x); },
                         [](const bool* x) { return std::string(*x ? "true" : "false"); },
                         [](const std::string* x) { return word(*x); },
                         [](const std::optional<double>* x) { return *x ? number_text(**x) : "none"; }},
                    key.target);
}

}  // namespace

std::string markdown(std::span<const Key> keys) {
  std::ostringstream out;
  for (const Key& key : keys) {
    const Range& r = key.range;
    out << "| `" << key.path << "` | " << key.unit << " | ";
    if (r.high != r.low) out << (r.above_low ? "(" : "[") << number_text(r.low) << ", " << number_text(r.high) << "]";
    out << " | " << default_text(key) << " | " << key.meaning << " | " << key.how << " |\n";
  }
  return out.str();
}

tl::expected<std::uint64_t, ConfigError> hash_of_files(const std::string& vehicle, const std::string& model) {
  const auto first = contents(vehicle, ".vehicle.toml"), second = contents(model, ".model.toml");
  if (!first) return tl::unexpected(first.error());
  if (!second) return tl::unexpected(second.error());
  return fnv1a(*second, fnv1a(std::string_view("\0", 1), fnv1a(*first)));
}

tl::expected<StrictTable, ConfigError> StrictTable::open(const std::string& path, std::string_view suffix) {
  const auto text = contents(path, suffix);
  if (!text) return tl::unexpected(text.error());
  try {
    return StrictTable(path, toml::parse(*text, path));
  } catch (const toml::parse_error& e) {
    std::ostringstream message;
    message << path << ":" << e.source().begin.line << ": not valid TOML: " << e.description();
    return tl::unexpected(ConfigError{ConfigError::Kind::invalid, message.str()});
  }
}

ConfigError StrictTable::error(std::string_view path, const std::string& what_would_be_right) const {
  toml::source_index line = 0;
  for (std::string_view at = path; line == 0 && !at.empty(); at = parent_of(at))
    if (const toml::node* node = root_.at_path(at).node()) line = node->source().begin.line;
  const toml::node* node = root_.at_path(path).node();
  std::ostringstream message;
  message << file_ << ":" << (line > 0 ? line : 1) << ": key '" << path
          << "' = " << (node ? value_text(*node) : "(missing)") << ": " << what_would_be_right;
  return {ConfigError::Kind::invalid, message.str()};
}

void StrictTable::change(std::string_view path, double value) {
  toml::table* table = &root_;
  for (auto dot = path.find('.'); dot != std::string_view::npos; dot = path.find('.')) {
    table->insert(path.substr(0, dot), toml::table());
    auto* below = table->get(path.substr(0, dot))->as_table();
    if (!below) break;  // a value stands where a table would: the whole path is refused as unknown
    table = below;
    path.remove_prefix(dot + 1);
  }
  table->insert_or_assign(path, value);
}

std::optional<std::vector<double>> StrictTable::numbers(std::string_view path, std::string_view key) const {
  const toml::table* table = root_.at_path(path).as_table();
  const toml::node* entry = table ? table->get(key) : nullptr;
  const toml::array* list = entry ? entry->as_array() : nullptr;
  if (!list) return std::nullopt;
  std::vector<double> all;
  for (const auto& number : *list) all.push_back(number.value<double>().value_or(NAN));
  return all;
}

std::vector<const toml::node*> StrictTable::nodes(std::string_view path, std::string_view key) const {
  std::vector<const toml::node*> found;
  const toml::array* tables = root_.at_path(path).as_array();
  for (std::size_t i = 0; tables && i < tables->size(); ++i) {
    const toml::table* table = tables->get(i)->as_table();
    const toml::node* entry = table ? table->get(key) : nullptr;
    if (const toml::array* list = entry ? entry->as_array() : nullptr)
      for (const auto& node : *list) found.push_back(&node);
    else if (entry)
      found.push_back(entry);
  }
  return found;
}

ConfigError StrictTable::error_at(const toml::node& node, std::string_view path,
                                  const std::string& what_would_be_right) const {
  std::ostringstream message;
  message << file_ << ":" << std::max<toml::source_index>(node.source().begin.line, 1) << ": key '" << path
          << "': " << what_would_be_right;
  return {ConfigError::Kind::invalid, message.str()};
}

tl::expected<void, ConfigError> StrictTable::reject_unknown(const toml::table& table, const std::string& prefix,
                                                            std::span<const Key> keys) const {
  for (const auto& [key, node] : table) {
    const std::string path = prefix + std::string(key.str());
    // A quoted key with a dot in it only looks like a path.
    const bool quoted_path = key.str().find('.') != std::string_view::npos;
    if (!quoted_path && std::ranges::find(keys, path, &Key::path) != keys.end()) continue;
    const bool holds_keys = std::ranges::any_of(keys, [&](const Key& k) { return k.path.starts_with(path + "."); });
    if (quoted_path || !holds_keys) {
      std::ostringstream message;
      message << file_ << ":" << key.source().begin.line << ": key '" << path << "' = " << value_text(node)
              << ": unknown; known here: " << names_below(prefix, keys);
      return tl::unexpected(ConfigError{ConfigError::Kind::invalid, message.str()});
    }
    if (!node.is_table()) return tl::unexpected(error(path, "needs a table with " + names_below(path + ".", keys)));
    if (auto below = reject_unknown(*node.as_table(), path + ".", keys); !below) return below;
  }
  return {};
}

tl::expected<void, ConfigError> StrictTable::store(const Key& key) const {
  const auto stored = [](auto value, auto* target) -> tl::expected<void, ConfigError> {
    if (!value) return tl::unexpected(value.error());
    *target = std::move(*value);
    return {};
  };
  const auto number = [&]() -> tl::expected<double, ConfigError> {
    const toml::node* node = root_.at_path(key.path).node();
    const Range& range = key.range;
    // A TOML boolean would convert to a number; only integers and floats are meant.
    const auto value = node && node->is_number() ? node->value<double>() : std::nullopt;
    const bool fits = value && (range.above_low ? *value > range.low : *value >= range.low) && *value <= range.high;
    if (!fits) return tl::unexpected(error(key.path, range_text(range)));
    return *value;
  };
  const auto whole = [&]() -> tl::expected<int, ConfigError> {
    const auto value = number();
    if (!value) return tl::unexpected(value.error());
    if (*value != std::floor(*value)) return tl::unexpected(error(key.path, "needs a whole number"));
    return static_cast<int>(*value);
  };
  return std::visit(Each{[](std::monostate) { return tl::expected<void, ConfigError>(); },
                         [&](double* x) { return stored(number(), x); },
                         [&](std::optional<double>* x) { return stored(number(), x); },
                         [&](int* x) { return stored(whole(), x); }, [&](bool* x) { return stored(flag(key.path), x); },
                         [&](std::string* x) { return stored(text(key.path), x); }},
                    key.target);
}

tl::expected<void, ConfigError> StrictTable::read(std::span<const Key> keys) const {
  if (auto known = reject_unknown(root_, "", keys); !known) return known;
  for (const Key& key : keys) {
    const bool may_miss = key.presence == Key::Presence::optional ||
                          (key.presence == Key::Presence::with_parent && !has(parent_of(key.path)));
    if (may_miss && !has(key.path)) continue;
    if (auto good = store(key); !good) return good;
  }
  return {};
}

tl::expected<std::string, ConfigError> StrictTable::text(std::string_view path) const {
  const auto value = root_.at_path(path).value<std::string>();
  if (!value || value->empty()) return tl::unexpected(error(path, "needs a string that is not empty"));
  if (std::ranges::any_of(*value, [](unsigned char c) { return c < ' ' || c == 0x7f; }))
    return tl::unexpected(error(path, "needs a string without control characters"));
  return *value;
}

tl::expected<bool, ConfigError> StrictTable::flag(std::string_view path) const {
  const auto value = root_.at_path(path).value_exact<bool>();
  if (!value) return tl::unexpected(error(path, "needs true or false"));
  return *value;
}

}  // namespace backwash::config

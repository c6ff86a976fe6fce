// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <toml++/toml.h>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <variant>
#include <vector>

#include "core/config/config.hpp"

namespace backwash::config {

/// Numbers from low to high; the lower end left out when `above_low`.
struct Range {
  double low, high;
  bool above_low = false;
};

/// One key of a file: the only description of it, by which it is read, told of and printed in docs/interfaces.md.
struct Key {
  enum class Presence {
    required,
    optional,     ///< the target keeps its default
    with_parent,  ///< the table that holds it may be absent as a whole, not this key alone
  };
  /// Where its value goes. Nowhere: whatever it holds is allowed, and left alone.
  using Target = std::variant<std::monostate, double*, int*, bool*, std::string*, std::optional<double>*>;

  std::string_view path;  ///< dotted
  Target target;
  Range range = {0, 0};  ///< of a number; of an int whole ones alone
  Presence presence = Presence::required;
  std::string_view unit, meaning;
  std::string_view how = {};     ///< to measure or choose it
  std::string_view absent = {};  ///< what counts where it is not in the file, if the target's own value does not say so
};

/// A key that may be there, and is read by another than StrictTable::read().
inline Key read_elsewhere(std::string_view path, std::string_view meaning = {}) {
  return {path, {}, {0, 0}, Key::Presence::optional, {}, meaning};
}

/// The keys as rows of Markdown: | key | unit | range | default | meaning | how |. Their targets hold the defaults.
std::string markdown(std::span<const Key> keys);

/// markdown() of the keys of a file of each kind.
std::string vehicle_file_keys();
std::string model_file_keys();
std::string daemon_file_keys();

/// A TOML document that accepts exactly the keys it is told of. Every error is one line
/// `FILE:LINE: key 'a.b' = value: what would be right`.
class StrictTable {
 public:
  /// `path`: a file, or `builtin:NAME` for the embedded NAME`suffix`. Errors: not_found; invalid for bad TOML.
  static tl::expected<StrictTable, ConfigError> open(const std::string& path, std::string_view suffix);

  /// Stores every value. Error: the first unknown key, wrong type, value out of range (NaN is in no range) or missing
  /// key.
  tl::expected<void, ConfigError> read(std::span<const Key> keys) const;
  /// As if the file had this number there; a table of the path that it lacks is added.
  void change(std::string_view path, double value);
  /// A string that is not empty and holds no control characters.
  tl::expected<std::string, ConfigError> text(std::string_view path) const;
  /// true or false.
  tl::expected<bool, ConfigError> flag(std::string_view path) const;
  /// The numbers of the list `key`, which may hold dots, in the table at `path`; nothing where there is no such list.
  std::optional<std::vector<double>> numbers(std::string_view path, std::string_view key) const;
  /// The entries of the lists `key` in every table of the list of tables at `path`; a `key` that is no list is returned
  /// itself.
  std::vector<const toml::node*> nodes(std::string_view path, std::string_view key) const;
  /// Error about a node of the file.
  ConfigError error_at(const toml::node& node, std::string_view path, const std::string& what_would_be_right) const;
  bool has(std::string_view path) const { return static_cast<bool>(root_.at_path(path)); }
  /// Error about a key that is in the file or missing from it: names its line (the parent's, if missing) and value.
  ConfigError error(std::string_view path, const std::string& what_would_be_right) const;

 private:
  StrictTable(std::string file, toml::table root) : file_(std::move(file)), root_(std::move(root)) {}
  tl::expected<void, ConfigError> reject_unknown(const toml::table& table, const std::string& prefix,
                                                 std::span<const Key> keys) const;
  tl::expected<void, ConfigError> store(const Key& key) const;

  std::string file_;
  toml::table root_;
};

}  // namespace backwash::config

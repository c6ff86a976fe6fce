// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <toml++/toml.h>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "core/config/config.hpp"

namespace backwash::config {

/// Numbers from low to high; the lower end left out when `above_low`.
struct Range {
  double low, high;
  bool above_low = false;
};

/// One number of a file: the only description of its name, range and whether it may be absent.
struct NumberKey {
  enum class Presence {
    required,
    optional,     ///< the target keeps its default
    with_parent,  ///< the table that holds it may be absent as a whole, not this key alone
  };
  std::string_view path;  ///< dotted
  double* target;
  Range range;
  Presence presence = Presence::required;
};

/// A TOML document that accepts exactly the keys it is told of. Every error is one line
/// `FILE:LINE: key 'a.b' = value: what would be right`.
class StrictTable {
 public:
  /// `path`: a file, or `builtin:NAME` for the embedded NAME`suffix`. Errors: not_found; invalid for bad TOML.
  static tl::expected<StrictTable, ConfigError> open(const std::string& path, std::string_view suffix);

  /// Stores every number. `others`: keys that are allowed and left alone, whatever they hold. Error: the first unknown
  /// key, wrong type, value out of range (NaN is in no range) or missing key.
  tl::expected<void, ConfigError> read(std::span<const NumberKey> keys, std::span<const std::string_view> others) const;
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
                                                 std::span<const NumberKey> keys,
                                                 std::span<const std::string_view> others) const;

  std::string file_;
  toml::table root_;
};

}  // namespace backwash::config

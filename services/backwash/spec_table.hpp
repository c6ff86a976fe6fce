// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <toml++/toml.h>

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace backwash::services {

/// A table of a TOML file that is told which keys it may hold. Each reader takes a key's value, or `otherwise` where
/// the key is absent; without one the key is needed. All throw Failure 78, `FILE:LINE: what would be right`.
class SpecTable {
 public:
  /// Throws Failure 66 for a file that is not there.
  static SpecTable open(const std::string& path);

  void only(const std::vector<std::string_view>& known) const;
  /// A table in it, with these keys alone; it must be there.
  SpecTable table(const std::string& key, const std::vector<std::string_view>& known) const;
  std::string text(const std::string& key, const std::optional<std::string>& otherwise) const;
  /// A list of texts, or one text.
  std::vector<std::string> texts(const std::string& key,
                                 const std::optional<std::vector<std::string>>& otherwise) const;
  double number(const std::string& key, double low, double high, std::optional<double> otherwise) const;
  std::size_t count(const std::string& key, double low, double high, std::optional<std::size_t> otherwise) const;
  [[noreturn]] void wrong(const std::string& key, const std::string& what) const;

 private:
  SpecTable(std::string path, std::shared_ptr<const toml::table> root, const toml::table& table)
      : path_(std::move(path)), root_(std::move(root)), table_(table) {}

  std::string path_;
  std::shared_ptr<const toml::table> root_;  ///< a copy of a table would not know its lines
  const toml::table& table_;                 ///< root_ or a table in it
};

}  // namespace backwash::services

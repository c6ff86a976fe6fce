// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string_view>

namespace backwash::config {

/// A file of core/config/files, compiled into the program so that `builtin:NAME` needs no installation.
struct BuiltinFile {
  std::string_view name;  ///< such as "quad-5in.model.toml"
  std::string_view text;
};
std::span<const BuiltinFile> builtin_files() noexcept;

}  // namespace backwash::config

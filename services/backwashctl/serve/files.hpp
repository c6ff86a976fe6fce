// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string_view>

namespace backwash::ctl {

/// A file of services/backwashctl/serve that is part of the program.
struct PageFile {
  std::string_view name, text;
};
std::span<const PageFile> page_files() noexcept;

}  // namespace backwash::ctl

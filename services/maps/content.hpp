// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "core/map/load_map.hpp"

namespace backwash::maps {

/// The bytes of a file of up to files::kLargestTable; `wanted` as in files::read_file.
tl::expected<std::string, map::MapError> content_of(const std::string& path, const std::string& wanted);

}  // namespace backwash::maps

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

namespace backwash::maps {

/// The bytes of a chunk of a recording that is compressed by "lz4" or "zstd" (https://mcap.dev/spec/registry), `size`
/// in all and at most files::kLargestTable, or what is wrong with it.
tl::expected<std::string, std::string> unpacked(std::string_view compression, std::string_view packed,
                                                std::uint64_t size);

}  // namespace backwash::maps

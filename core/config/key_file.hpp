// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <tl/expected.hpp>

namespace backwash::config {

using SecretKey = std::array<std::uint8_t, 32>;

/// A key of 32 bytes: a regular file that holds them as they are, or as 64 hexadecimal digits and a line end. Nobody
/// but its owner may have any right to it, and nobody may execute it (mode 0600 or 0400). Error: what is wrong and what
/// would be right, without the path and without a byte of the content.
tl::expected<SecretKey, std::string> read_key_file(const std::string& path);

}  // namespace backwash::config

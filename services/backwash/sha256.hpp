// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace backwash::services {

/// SHA-256 (FIPS 180-4) of these bytes, 64 hexadecimal digits.
std::string sha256(std::string_view bytes);
/// The same of a regular file, read in pieces. Throws Failure 66 where there is none that can be read.
std::string sha256_of_file(const std::string& path);

}  // namespace backwash::services

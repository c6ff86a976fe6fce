// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace backwash::files {

/// Bytes as the 64 letters of RFC 4648, padded.
std::string base64(std::string_view bytes);
/// Nothing where a text is none of base64().
std::optional<std::string> from_base64(std::string_view text);

}  // namespace backwash::files

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>

namespace backwash::daemon {

/// One line for the operator.
using Line = std::array<char, 192>;

/// What another process sent, fit for a log line, an answer or a terminal: at most `most` of its bytes, the rest as
/// "…"; bytes that are no printable ASCII as \xNN, the backslash too, so that nothing passes for another line, an
/// escape sequence or an escape of ours.
inline std::string printable(std::string_view text, std::size_t most = 64) {
  std::string safe;
  for (const char c : text.substr(0, most)) {
    if (c >= ' ' && c <= '~' && c != '\\') {
      safe += c;
      continue;
    }
    char escaped[5];
    std::snprintf(escaped, sizeof escaped, "\\x%02x", static_cast<unsigned>(static_cast<unsigned char>(c)));
    safe += escaped;
  }
  return text.size() > most ? safe + "…" : safe;
}

}  // namespace backwash::daemon

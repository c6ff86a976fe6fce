// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <string>

namespace backwash {

/// What printf would print, up to 319 bytes of it.
std::string formatted(const char* format, auto... values) {
  char line[320];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

}  // namespace backwash

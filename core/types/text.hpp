// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <string>

#include "core/types/geometry.hpp"

namespace backwash {

/// A number with a fixed count of decimals.
inline std::string to_text(double value, int decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

/// A place in metres as messages name it: "(1.00, 2.00, 0.80)".
inline std::string to_text(const Vec3& p) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.2f, %.2f, %.2f)", p.x(), p.y(), p.z());
  return text;
}

}  // namespace backwash

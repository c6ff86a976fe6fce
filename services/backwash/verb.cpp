// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/verb.hpp"

#include <cmath>
#include <cstdio>

namespace backwash::services {

Option add_point(Command& command, const std::string& name, std::optional<Vec3>& target, const std::string& help) {
  const auto parse = [&target, name](const std::string& text) {
    Vec3 p;
    char rest = 0;
    const int read = std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &p.x(), &p.y(), &p.z(), &rest);
    if (read != 3 || !p.allFinite()) {
      throw UsageError(name + ": '" + text + "' must be three numbers x,y,z in metres");
    }
    target = p;
  };
  return command.add_text(name, parse, help).type_name("X,Y,Z");
}

}  // namespace backwash::services

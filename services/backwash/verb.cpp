// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/verb.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace backwash::services {

std::vector<double> read_numbers(const std::string& option, const std::string& text, std::size_t count,
                                 const std::string& are) {
  std::vector<double> numbers;
  const char* at = text.c_str();
  char* end = nullptr;
  for (double value = std::strtod(at, &end); end != at; value = std::strtod(at, &end)) {
    if (std::isfinite(value)) numbers.push_back(value);
    if (*end != ',') break;
    at = end + 1;
  }
  if (numbers.size() != count || end != text.c_str() + text.size() || end == at)
    throw UsageError(option + ": '" + text + "' must be " + are);
  return numbers;
}

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

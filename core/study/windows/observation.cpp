// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/observation.hpp"

#include <algorithm>

namespace backwash::study {

const char* channel_name(Channel c) {
  // clang-format off
  static const char* const kNames[] = {
      "mean x", "mean y", "mean z", "ln variance x", "ln variance y", "ln variance z", "tail", "thrust delay",
      "thrust slope", "command delay, level", "command delay, z", "tilt delay", "line 1", "line 2", "line 3", "line 4",
      "motor 1", "motor 2", "motor 3", "motor 4", "rpm 1", "rpm 2", "rpm 3", "rpm 4",
      "dropout 1", "dropout 2", "dropout 3", "dropout 4"};
  // clang-format on
  return kNames[c];
}

bool Observations::measured(Channel c) const {
  return std::any_of(weight[c].begin(), weight[c].end(), [](double w) { return w > 0; });
}

void Observations::group(const std::vector<double>& by_flight) {
  units = {};
  for (std::size_t f = 0; f < by_flight.size(); ++f)
    if (f + 1 == by_flight.size() || by_flight[f + 1] != by_flight[f]) units.first.push_back(first[f + 1]);
}

}  // namespace backwash::study

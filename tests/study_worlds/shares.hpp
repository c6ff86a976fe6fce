// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace study_worlds {

/// A cause in some of twelve flights.
struct SharedFault {
  std::string fault;   ///< a cause of the generator; "rpm": a rotor's rpm reads 0.54 of what it is
  int count = 4;       ///< of 12 flights
  std::string layout;  ///< "run": behind each other; "any": any of them; "from": to the last; "since": from
                       ///< within the first of them; "each": from a moment on in each of all twelve
  double size = 1;     ///< in units of the effect-size table
};

/// How the study told it.
struct SharedOutcome {
  SharedFault hidden;
  std::uint64_t seed = 0;
  std::vector<int> truth, flights;  ///< in which it acts, from 0: hidden, told
  double since_s = 0, told_since_s = -1;
  bool found = false;  ///< told, in some flights, by its name or in a set
  bool rotor = true;   ///< the rotor is right, where there is one
  bool wrong = false;  ///< a name beside it that is not hidden
  std::string told;
  bool exact() const { return found && flights == truth; }
};

SharedOutcome score(const SharedFault& hidden, std::uint64_t seed, const std::filesystem::path& folder);
nlohmann::json to_json(const SharedOutcome& outcome);
/// A row for each kind of fault.
std::string shares_table(const std::vector<SharedOutcome>& outcomes);

}  // namespace study_worlds

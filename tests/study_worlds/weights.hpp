// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace study_worlds {

/// A heavy weight near one rotor, or a rotor that gives less, on one of three craft.
struct RotorTrial {
  std::string hidden;      ///< "weight", "propeller", "none"
  std::string craft;       ///< "quad-5in", "quad-7in", "drawn": other mass, thrust and curve
  bool reference = false;  ///< the study is given six sound flights
};

/// How the study told it.
struct RotorOutcome {
  RotorTrial trial;
  std::uint64_t seed = 0;
  double size = 0;           ///< of mass, or of the rotor's command
  bool wrong = false;        ///< alone in its set: propeller_damage of a weight, payload of a propeller, either of none
  bool in_set = false;       ///< the truth is in some set
  bool right_alone = false;  ///< alone in its set
  std::string told;
};

RotorOutcome score(const RotorTrial& trial, std::uint64_t seed, const std::filesystem::path& folder);
nlohmann::json to_json(const RotorOutcome& outcome);
/// A row for each kind of trial.
std::string weights_table(const std::vector<RotorOutcome>& outcomes);

}  // namespace study_worlds

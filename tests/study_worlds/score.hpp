// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tests/study_worlds/world.hpp"

namespace study_worlds {

/// One row of the confusion matrix: what its worlds hide and in what circumstances.
struct MatrixCell {
  std::string name;                 ///< "ceiling", "none", "trim, no yaw", "two causes"
  std::vector<std::string> causes;  ///< hidden; empty: none
  std::string confound = "";
  bool two_drawn = false;  ///< two different causes drawn from the seed
  bool reference = true;   ///< the study is given six sound flights
};
/// Every cause, unknown, none, two causes, and the confounded pairs of flights that cannot tell.
const std::vector<MatrixCell>& cells();

/// A parameter that study and generator give in the same unit.
struct Compared {
  std::string name;
  double value, low, high, truth;
  std::optional<double> best;  ///< with which the study's form, at its scale, comes nearest to the hidden effect
  bool covers(double x) const { return low <= x && x <= high; }
};

/// How the study fared in one world.
struct WorldOutcome {
  std::string cell;
  std::uint64_t seed = 0;
  double size = 1;
  std::vector<std::string> truth;              ///< hidden causes
  std::vector<std::vector<std::string>> sets;  ///< per told cause: its name, then its rivals
  std::vector<std::string> where;              ///< of each: in which flights, if not in all
  std::vector<std::string> unknown;            ///< regressors of unknown structure
  std::vector<Compared> compared;              ///< of the hidden cause, if its name comes first in a set
  std::optional<double> error;                 ///< |parameters − truth| over |truth|
  std::optional<double> gain_share;            ///< held-out gain over that of the true effect's own column
  std::string structure;                       ///< of a hidden "unknown"
  double explained = 1;             ///< share of the variance between windows that it explains, of the channel of most
  double study_s = 0, world_s = 0;  ///< CPU: of the search, and of flying and observing

  bool right() const;       ///< exactly the hidden causes, each alone in its set; "unknown": structure and no name
  bool in_sets() const;     ///< every hidden cause is in some set (unknown: told)
  bool wrong_name() const;  ///< some set holds no hidden cause
  bool silent() const { return sets.empty() && unknown.empty(); }
};

/// Draws, flies, studies and compares one world. `folder` is written to.
WorldOutcome score(const MatrixCell& cell, std::uint64_t seed, double size, int flights,
                   const std::filesystem::path& folder);

nlohmann::json to_json(const WorldOutcome& outcome);
WorldOutcome from_json(const nlohmann::json& json);

}  // namespace study_worlds

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tests/study_worlds/score.hpp"

namespace study_worlds {

/// Which further flights a world flies until the study tells its hidden cause alone.
enum class Further {
  designed,   ///< the way that the design chose after the first flights
  same_kind,  ///< as the world's first ones: with the same circumstances
  free_kind,  ///< of the generator's own kind, without the circumstances that confound
  of_list,    ///< each drawn at random from the ways that fit in the map
};
inline constexpr const char* kFurther[] = {"designed", "same_kind", "free_kind", "of_list"};

/// One world whose first flights could not distinguish.
struct Trial {
  std::string cell, told, way, message;  ///< what the first study told; what was designed
  std::uint64_t seed = 0;
  bool applies = false;  ///< the first study could not distinguish, and the hidden cause was in its set
  int expected = 0;      ///< flights that the design told, 0: none
  double separated = 0;  ///< P after so many
  std::size_t fitting = 0, left_out = 0;
  /// By Further: flights after which the hidden cause was told alone; most + 1: not within `most`.
  std::vector<int> needed;
};

struct TrialOptions {
  int flights = 12, most = 12;  ///< at first; further ones of each kind
  double seconds = 90;          ///< of each further flight, of every kind
  double size = 1;              ///< in units of the effect-size table
};

/// One world. `folder` is written to.
Trial trial(const MatrixCell& cell, std::uint64_t seed, const TrialOptions& options,
            const std::filesystem::path& folder);

nlohmann::json to_json(const Trial& trial);
Trial trial_from_json(const nlohmann::json& json);

}  // namespace study_worlds

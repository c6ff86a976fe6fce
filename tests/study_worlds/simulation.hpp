// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tests/study_worlds/world.hpp"

namespace study_worlds {

/// How to prove that an extended simulation is nearer to what is measured.
struct ProofRequest {
  std::string cause;  ///< hidden
  std::uint64_t seed = 1;
  int flights = 12;  ///< studied; as many further ones are studied with the extended model
  int held_out = 6;  ///< of those, whose set-points are simulated
  int replicas = 4;  ///< flights with other gusts whose mean is what a simulation says
};

/// One world: what was hidden, studied, extended, and simulated on flights that the study has not seen.
struct Proof {
  std::string cause;
  std::uint64_t seed = 0;
  std::string told;     ///< by the first study
  std::string refused;  ///< why the cause does not join the model, if it was named
  bool simulated = false;
  /// Error of simulated against measured windows over that of the truth's own simulation, in the cause's channels: root
  /// mean square over them. The truth's: the generator with the hidden effect, the same plans, other gusts and scatter.
  double before = 0, after = 0;
  /// Of the mean squares that the truth's own simulation takes away, the share that the extension does.
  double share = 0;
  double unit_before = 0, unit_after = 0, unit_oracle = 0;  ///< errors in the first of these channels, in its unit
  std::string channel;                                      ///< that channel
  std::string told_after;  ///< by a study of the extended model on further flights; "nothing" is what is wanted
};

Proof prove(const ProofRequest& request, const std::filesystem::path& folder);

nlohmann::json to_json(const Proof& proof);
Proof proof_from_json(const nlohmann::json& json);
/// One row for each cause.
std::string proof_table(const std::vector<Proof>& proofs);

}  // namespace study_worlds

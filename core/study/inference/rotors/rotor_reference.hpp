// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/study/inference/rotors/rotor_law.hpp"

namespace backwash::study {

/// What a group of flights says of its rotors against flights of the same vehicle known to be sound. Rotors 1 and 3
/// face each other, 2 and 4 as well.
struct RotorVerdict {
  enum class Kind {
    as_sound,            ///< differs by no more than sound flights do, and a damage of 6 % would have shown
    propeller_damage,    ///< of `rotor`
    payload,             ///< an off-centre weight
    cannot_distinguish,  ///< what the set holds
    neither,             ///< differs, and fits neither
  } kind;
  RotorsTold told;
  Contrasts t;         ///< differences in standard errors of a further flight: twist, rotors 1 and 3, 2 and 4
  double minimum = 0;  ///< least d that would be named propeller_damage with 80 % power
};
const char* to_string(RotorVerdict::Kind kind);

/// By told_of, with what the sound flights scatter by (scatter_of), so that a judged condition never took part in
/// setting a threshold. The flights of a group count as one, since what moves the contrasts between sessions is common
/// to them. The sound flights count as independent: where they are of few sessions, false alarms are more
/// (docs/measurements/recordings.md). Flights as of rotor_shares. Nothing with fewer than 4 sound flights or an empty
/// group.
std::optional<RotorVerdict> judge_rotors(const std::vector<Eigen::Array4d>& sound,
                                         const std::vector<Eigen::Array4d>& group);

}  // namespace backwash::study

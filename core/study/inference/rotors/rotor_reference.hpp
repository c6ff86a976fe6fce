// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/study/windows/observation.hpp"

namespace backwash::study {

/// How a hovering vehicle shares its thrust, as ln commands less their mean, in three contrasts. Rotors 1 and 3 face
/// each other and turn alike, 2 and 4 the other way (Crazyflie's numbers; any X with facing rotors 1–3 and 2–4).
struct RotorContrasts {
  double yaw;   ///< (s1 − s2 + s3 − s4)/4
  double a, b;  ///< (s3 − s1)/2, (s4 − s2)/2
};
/// Mean over each flight's windows in flight (the Observer leaves out those in which the rotors rest); flights without
/// motor commands are left out.
std::vector<RotorContrasts> rotor_contrasts(const Observations& seen);

/// Share of thrust command that a rotor needs more, and its 95 % interval.
struct RotorNeed {
  double d = 0, low = 0, high = 0;
};

/// What may be the matter with rotors, told by their commands alone.
enum class RotorState { sound, propeller_damage, payload };
const char* to_string(RotorState state);

/// What a group of flights says of its rotors against flights of the same vehicle known to be sound.
struct RotorVerdict {
  enum class Kind {
    as_sound,            ///< differs by no more than sound flights do, and a damage of 6 % would have shown
    propeller_damage,    ///< of `rotor`
    payload,             ///< an off-centre weight
    cannot_distinguish,  ///< what `set` holds
    neither,             ///< differs, and fits neither
  } kind;
  std::vector<RotorState> set;         ///< all that the flights do not tell apart
  std::size_t rotor = 0;               ///< 1 … 4, the damage that fits best
  double d = 0, low = 0, high = 0;     ///< share of thrust command that `rotor` needs more, 95 %
  std::array<RotorNeed, 4> each;       ///< of every rotor, if it is that one alone
  double t_yaw = 0, t_a = 0, t_b = 0;  ///< differences in standard errors of a further flight
  double t_d = 0, needed = 0;          ///< of d, and what it must pass: 5 % over the four rotors
  double minimum = 0;                  ///< least d that would be named propeller_damage with 80 % power
};
const char* to_string(RotorVerdict::Kind kind);

/// A damaged propeller needs (1 + d) of its command for its thrust: contrasts ln(1 + d) (±¼ yaw, ±½ of its pair, 0). A
/// weight moves a and b and leaves yaw, because facing rotors answer it with opposite signs; so yaw (Student's t, 5 %)
/// is what tells them apart. Thresholds come from the sound flights alone (their scatter per contrast, for a further
/// flight), so that a judged condition never took part in setting them; the flights of a group count as one, since
/// what moves the contrasts between sessions is common to them. The sound flights count as independent: where they are
/// of few sessions, false alarms are more (docs/measurements/recordings.md). `minimum`: noncentral t by a normal, δ = t
/// + z₀.₈ √(1
/// + t²/2n) of both tests. Nothing with fewer than 4 sound flights or an empty group.
std::optional<RotorVerdict> judge_rotors(const std::vector<RotorContrasts>& sound,
                                         const std::vector<RotorContrasts>& group);

}  // namespace backwash::study

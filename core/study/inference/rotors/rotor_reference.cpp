// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/rotors/rotor_reference.hpp"

#include "core/study/inference/rotors/sound_rotors.hpp"

namespace backwash::study {
namespace {

RotorVerdict::Kind kind_of(const RotorsTold& told, double minimum) {
  using Kind = RotorVerdict::Kind;
  if (told.set.empty()) return Kind::neither;
  if (told.holds(RotorState::sound))
    return minimum > kRules.rotor_of_interest ? Kind::cannot_distinguish : Kind::as_sound;
  if (told.set.size() > 1) return Kind::cannot_distinguish;
  return told.holds(RotorState::payload) ? Kind::payload : Kind::propeller_damage;
}

}  // namespace

const char* to_string(RotorVerdict::Kind kind) {
  static const char* const kNames[] = {"as_sound", "propeller_damage", "payload", "cannot_distinguish", "neither"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::optional<RotorVerdict> judge_rotors(const std::vector<Eigen::Array4d>& sound,
                                         const std::vector<Eigen::Array4d>& group) {
  if (static_cast<double>(sound.size()) < kRules.fewest_sound || group.empty()) return std::nullopt;
  const SoundScatter scatter = scatter_of(sound);
  const Eigen::Array4d ln = mean_of(group) - mean_of(sound);
  RotorVerdict v{{}, told_of({ln}, scatter), contrasts_of(ln, kPairings[0]) / scatter.scale, least_damage(scatter)};
  v.kind = kind_of(v.told, v.minimum);
  if (v.kind == RotorVerdict::Kind::as_sound) v.told.set = {RotorState::sound};
  return v;
}

}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/study/windows/observation.hpp"

namespace backwash::study {

/// How a craft shares its thrust among its rotors: ln commands in three contrasts of facing rotors (i, j) and (k, l):
/// (s_i + s_j − s_k − s_l)/4, the twist; (s_j − s_i)/2; (s_l − s_k)/2.
using Contrasts = Eigen::Array3d;
/// i, j, k, l from 0. Which rotors face each other depends on the autopilot: 1–3 and 2–4, 1–2 and 3–4, or 1–4 and 2–3.
using Pairing = std::array<std::size_t, 4>;
inline constexpr std::array<Pairing, 3> kPairings = {{{0, 2, 1, 3}, {0, 1, 2, 3}, {0, 3, 1, 2}}};
Contrasts contrasts_of(const Eigen::Array4d& ln, const Pairing& pairing);
/// Four ln shares, mean 0, of contrasts.
Eigen::Array4d shares_of(const Contrasts& contrasts, const Pairing& pairing);

/// What may be the matter with rotors.
enum class RotorState : std::uint8_t { sound, propeller_damage, payload };
const char* to_string(RotorState state);

/// Four rotors against what is known of the craft.
struct RotorDifference {
  Eigen::Array4d ln;                                          ///< commands
  Eigen::Array4d line = Eigen::Array4d::Zero();               ///< each one's ln power at its rate, standard errors
  std::span<const Pairing> pairings = {kPairings.data(), 1};  ///< that the craft may have
};

/// Share of thrust command that a rotor needs more, and its 95 % interval.
struct RotorNeed {
  double d = 0, low = 0, high = 0;
};

/// What a difference says.
struct RotorsTold {
  std::vector<RotorState> set{};    ///< those that are not excluded
  std::size_t rotor = 0;            ///< 0 … 3, the damage that fits best
  std::array<RotorNeed, 4> each{};  ///< of every rotor, if it is that one alone
  double lead = 0, needed = 0;      ///< nats of a damage over a sound craft, and those that chance passes at the level
  std::size_t heavy = 0;            ///< 0 … 3, the rotor that carries most of a weight
  double weight = 0;                ///< by how much more than the mean of the four, 1
  bool holds(RotorState state) const;
};

/// Hypotheses by likelihood (docs/model.md 8-9, 8-10): a sound craft; a propeller that needs (1 + d) of its command, d
/// > 0, and whose torque per thrust may have changed; a weight beside the middle, which does not twist. One is excluded
/// where another, or contrasts that are free, is likelier by more than in 1 − `rotor_level` of draws under it. So a
/// sound craft is told as damaged with at most that probability, as far as its scatter is known.
RotorsTold told_of(const RotorDifference& difference, const SoundScatter& sound);

/// Whether one propeller that needs ln (1 + d) = `need` is less than `rival_nats` behind none, where ln shares differ
/// by an unknown scale (docs/model.md 8-10b).
bool may_need(const Eigen::Array4d& ln, double need);

/// Least d that is told alone with 80 % power.
double least_damage(const SoundScatter& sound);

}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/study/inference/rotors/rotor_law.hpp"
#include "core/study/inference/search.hpp"

/// How the rotors of a sound craft differ, and what that leaves of what flights show.
namespace backwash::study {

/// Means of each flight's motor channels, ln; flights without motor commands are left out. (The Observer leaves out
/// windows in which the rotors rest.)
std::vector<Eigen::Array4d> rotor_shares(const Observations& seen);

Eigen::Array4d mean_of(const std::vector<Eigen::Array4d>& flights);

/// Rotors of flights of the craft that are known to be sound.
struct SoundRotors {
  std::vector<Eigen::Array4d> flights{};               ///< rotor_shares()
  Eigen::Array4d motor = Eigen::Array4d::Zero(), rpm;  ///< means of the channels
};
/// Nothing with fewer than 4 flights that have motor commands or rpm.
std::optional<SoundRotors> sound_rotors(const Observations& reference);

/// What `flights` say of a further session: their scatter per contrast and session_twist and session_pairs, which have
/// session_degrees, together, and the error of their mean.
SoundScatter scatter_of(const std::vector<Eigen::Array4d>& flights);
/// The same where nothing is known of a craft but that it is one: built_scatter.
SoundScatter built_rotors();

/// Four rotors against what is known, and by what those of a sound craft may differ from it.
struct RotorLevel {
  RotorDifference difference;
  SoundScatter sound;
  bool maybe_damaged = true;  ///< no reference flights exclude it
};
/// Whether a loss of all thrust, a share of it, may be that of one damaged rotor.
bool may_be_one_rotor(const RotorLevel& level, double lost);

/// What a form says of the rotors' commands; nothing of one that does not move them.
std::optional<RotorState> rotor_state(const Form& form);
/// The rivals of a cause that is told by the rotors' commands: the other name, unless it is excluded and the cause's
/// own is not.
void name_rotors(Accepted& cause, const RotorsTold& told);

/// What rotors show in all windows against the sound craft; nothing without motor commands.
std::optional<RotorsTold> rotors_of(const Observations& seen);
/// What they show where an amount is more than 0 (by window) against where it is not. As with reference flights: the
/// flights scatter about both levels, those without it count each, and of those with it neighbours count as one.
std::optional<RotorsTold> rotors_of(const Observations& seen, const std::vector<double>& amount);
/// Observations less the sound craft's own differences: as told by reference flights; and all that a sound craft may
/// show (rotors_of), since the search must not explain it.
struct SettledRotors {
  Observations seen;
  std::optional<RotorLevel> level;  ///< before that; nothing without motor commands
  double unjudged = 0;              ///< by how much the rotors' shares differ without that being judged, ln
};
SettledRotors settle_rotors(const std::optional<SoundRotors>& sound, Observations seen);

}  // namespace backwash::study

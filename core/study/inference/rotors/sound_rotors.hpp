// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/study/inference/search.hpp"

/// How the rotors of a sound craft differ, and what may be named beside that.
namespace backwash::study {

/// Motor and rpm channels (kMotor1 … kRpm4) of a sound craft.
struct SoundRotors {
  std::array<double, 8> mean{};  ///< ln, as in the channels
  double spread = 0;             ///< ln, of what flights differ from it by: one standard error
};
/// Of sound flights of the same craft; nothing with fewer than 4 that have motor commands or rpm. The error is that of
/// their mean, and no less than motor_scatter.
std::optional<SoundRotors> sound_rotors(const Observations& reference);

/// Takes the sound craft's own differences out of observations: as told by reference flights, or, without them, all
/// that a sound craft may have (rotor_spread). What is larger stays, and the shares of a craft of which one rotor
/// shakes.
struct SettledRotors {
  Observations seen;
  std::optional<double> unjudged;  ///< by how much the rotors' shares differ without that being judged, ln
};
SettledRotors settle_rotors(const std::optional<SoundRotors>& sound, Observations seen);

/// Commanded thrusts against two patterns: a propeller that gives less twists the craft, a weight beside the middle
/// does not.
struct YawBalance {
  double yaw = 0;       ///< (facing rotors of the larger difference − the two others) over all four, of their thrusts
  double error = 0;     ///< its standard error, of the rotors' spread
  double damage = 0;    ///< yaw that a damage of the largest need would give
  bool weight() const;  ///< the yaw is none, as far as is known
  bool propeller() const;  ///< it is that of a damage, as far as is known
};
/// `ln_thrust`: four, ln. Facing rotors: the one of the largest thrust and the one of the least. `spread`: of each, ln.
YawBalance yaw_balance(const std::array<double, 4>& ln_thrust, double spread);

/// What a cause that was told of the motors' commands may be called: both names unless the rotor's own line or the yaw
/// balance tells them apart. Changes the rivals of such a cause, and no other's. `seen`: observations; `taken_out`:
/// without this cause.
Accepted name_by_balance(Accepted cause, const Observations& seen, bool taken_out, double spread);

}  // namespace backwash::study

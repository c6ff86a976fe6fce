// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <random>
#include <string>

namespace study_worlds {

struct Instant;

/// What "unknown" is in a world: something that no name of the catalogue covers, drawn at random.
struct HiddenStructure {
  enum class Kind { tone, heading, wave, product, bump };
  enum class Quantity { x, y, z, yaw, t, temperature };
  enum class Where { level, up, variance };
  Kind kind = Kind::tone;
  Where where = Where::up;
  std::array<Quantity, 2> along = {Quantity::t, Quantity::t};  ///< the second of a product alone
  /// Per quantity its number in a unit of the kind's own (rad per unit of the quantity; of a bump its middle and width)
  /// and the phase, rad.
  std::array<double, 2> number{}, phase{};
  double direction = 0;  ///< of a level push, rad
};

HiddenStructure draw_structure(std::mt19937_64& rng);
/// Its value where a craft is; about 1 root mean square over flights.
double value_at(const HiddenStructure& structure, const Instant& now);
/// "tone of t 0.071 Hz, up".
std::string text_of(const HiddenStructure& structure);

}  // namespace study_worlds

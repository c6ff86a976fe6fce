// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/types/geometry.hpp"

namespace backwash::log {

/// One of the 24 right-handed turns of axes into axes: ours = turn · theirs. As text, our x, y and z in theirs, as
/// "x, -z, y" of a world with y up.
using Turn = Mat3;
/// Nothing: three axes, each once, with a sign before it or none, that make no mirror image.
std::optional<Turn> turn_of(const std::string& text);
std::string text_of(const Turn& turn);

/// A turn that has a name: "enu" and "ned" of worlds, "flu" and "frd" of bodies.
struct NamedTurn {
  const char* name;
  Turn turn;
};
const std::vector<NamedTurn>& named_worlds();
const std::vector<NamedTurn>& named_bodies();
/// Its name, or its text.
std::string called(const Turn& turn, const std::vector<NamedTurn>& names);

/// The turn into axes with z up that people use for a world (or body) whose `up` (± a unit vector of theirs) is up: the
/// heading, which no flight tells, is theirs as far as that can be.
Turn upright_world(const Vec3& up);
Turn upright_body(const Vec3& up);

/// Which of the world's axes and of the body's is up.
struct UpAxes {
  Vec3 world, body;
};

/// Which axes are up by the numbers (docs/model.md, 3-11): specific force is the weight's opposite on the mean, and a
/// craft accelerates along its thrust. Nothing: there is no attitude, the flight does not tell, or no axis fits.
/// Columns as in a flight log, in axes that may be turned; specific_force_x … in the body's, m/s².
std::optional<UpAxes> up_axes(const FlightLog& log);

/// A way to read the four columns of an attitude, and the axes that are up then.
struct AxesReading {
  UpAxes up;
  std::string keys;  ///< what a column map has to say for it; empty: the attitude as it stands
};
/// Every reading under which the flight tells its axes, that of the attitude as it stands first: its scalar may stand
/// in the first or the last column, and it may turn the world into the body. An inverse attitude in a world with z up
/// moves as an attitude with z down; a reading that has the craft below 0 throughout is left out where another has not.
std::vector<AxesReading> axes_readings(const FlightLog& log);

/// Which of the body's axes is up on the mean, where `up` is the world's. Nothing: there is no attitude, or none is.
std::optional<Vec3> body_up(const FlightLog& log, const Vec3& up);

/// What positions alone make of it: a sentence, where z stays at 0 while the craft is higher along another axis, or is
/// below 0 throughout; the axis that may be up. Without doubt: nothing.
std::optional<std::pair<std::string, Vec3>> flat_height(const FlightLog& log);

}  // namespace backwash::log

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/loop/position_loop.hpp"

/// The position loop of a vehicle file, driven by what a log holds.
namespace backwash::study {

/// Columns of a vector in these rows of a log. Precondition: it has them.
std::vector<Vec3> vectors(const log::FlightLog& log, const std::vector<std::size_t>& rows, const std::string& prefix,
                          const std::string& unit);

/// The set-points of a flight: absent velocities and accelerations are zero (docs/interfaces.md). Precondition: it has
/// positions among them.
std::vector<Setpoint> commands_of(const log::FlightLog& log, const std::vector<std::size_t>& rows);

/// Two rows of a log or more: times that rise (s), what was measured (W), and the set-points.
struct Flown {
  std::span<const double> t;
  std::span<const Vec3> p, v;
  std::span<const Setpoint> commands;
};

/// The loop with its set-points `command_age` later: a command acts from some time in the period before its row on
/// (held) or all along it (streamed).
loop::PositionLoop with_command_age(loop::PositionLoop loop, std::span<const double> t);

struct LoopMotion {
  std::vector<Vec3> p, v, a;
};
/// The closed loop at each row, fed with the set-points and its own state, against a level drag, 1/s, without the
/// loop's feedback delay. The middle of each piece of kWindowRules.loop_step at most is held; after twice
/// kWindowRules.held it starts again where the vehicle is.
LoopMotion loop_of(const Flown& log, const loop::PositionLoop& loop, double drag = 0);

/// What the loop answers to the logged state at each row, by each attitude lag (s): r of docs/model.md 3-1, m/s². The
/// middle of each piece of kWindowRules.loop_step at most is held; at the first row, and after twice kWindowRules.held,
/// r = u.
std::vector<std::vector<Vec3>> answers(const Flown& log, const loop::PositionLoop& loop, std::span<const double> lags);

}  // namespace backwash::study

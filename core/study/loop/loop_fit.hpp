// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/types/vehicle.hpp"

/// What flights say of a vehicle's position loop: the keys of its file that an autopilot's log can tell.
namespace backwash::study {

enum LoopKey : std::size_t { kKpLevel, kKdLevel, kLatency, kLag, kKpUp, kKdUp, kLoopKeys };
/// As in the vehicle file: "controller.kp.horizontal".
std::string_view name_of(LoopKey key);
double value_of(const Vehicle& vehicle, LoopKey key);

struct LoopEstimate {
  double value, low, high;  ///< 90 % interval
};
/// What a log does not excite, so that it says nothing of a key.
struct UnexcitedLoop {
  std::string log;
  LoopKey key;
};
struct LoopFit {
  std::array<std::optional<LoopEstimate>, kLoopKeys> keys;  ///< none where a log does not excite it
  std::vector<UnexcitedLoop> unexcited;
  std::size_t windows = 0;
  bool by_attitude = false, by_thrust = false;  ///< what the level and the vertical answer were seen in; else positions
};
struct LoopLog {
  std::string name;
  const log::FlightLog* log;
};
/// A log that tells nothing of any loop, and why.
struct LoopError {
  std::string log, what;
};

/// Fits what the loop answers to set-points and to its own errors (docs/model.md section 4: gains, latency, lag) by
/// least squares over windows of 2 s, their trends taken out. With attitude the level answer is g times the tilt, to
/// the state that is logged; with thrust too the vertical one is the thrust, by the mass and thrust curve of the
/// vehicle file. Elsewhere it is the position, by the set-points alone. Only what is slow counts of a tilt, as an
/// attitude loop of any order with the same mean lateness does there what one of first order does.
///
/// The interval is the wider one of two: windows as independent draws (sandwich), and logs left out in turn
/// (jackknife, Student's t). Two forms of the lag are fitted, of first order and half of it a pure delay: the middle is
/// told, and half of what they differ by stands beside the interval, with what loops of other orders add (measured). A
/// latency has a quarter of a row's period beside it: no log says when within a period a set-point began to act.
/// Precondition: at least two logs. Some seconds for three logs of 80 s.
tl::expected<LoopFit, LoopError> fit_loop(std::span<const LoopLog> logs, const Vehicle& start);

}  // namespace backwash::study

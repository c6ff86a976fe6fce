// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/log/raw/tick_log.hpp"
#include "core/report/page/timeline.hpp"
#include "core/types/geometry.hpp"
#include "core/types/mode.hpp"
#include "services/backwash/site/judged_maps.hpp"

namespace backwash::services {

/// A trajectory that was flown, with all that extended it.
struct StoryPiece {
  bool take_off = false;           ///< its commands rise on one vertical line
  double from_s = 0, until_s = 0;  ///< of its ticks, since the log's first tick
  Vec3 goal_W = Vec3::Zero();      ///< its last command, m
  std::size_t samples = 0, inside = 0;
  bool to_its_end = false;  ///< its last command was sent
  bool by_order = false;    ///< an operator ended it before
  double goal_error_m = 0;  ///< of the position at its last tick
  bool reached = false;     ///< flown to its end, and the position then within the set around it
  std::string fault;        ///< why it was left: the first reason that nobody asked for; empty without one
};

/// A tick with a judged position, or one in the air.
struct StorySample {
  double t_s;
  Vec3 p_W, command_W;  ///< measured (or true) and commanded position, m
  bool judged, inside, in_air;
  Vec3 error_over_bound;              ///< per axis; 0 where nothing was judged
  std::optional<double> clearance_m;  ///< body to obstacle, where it is judged
};

/// What a raw log tells of a flight, whatever kind it was: any number of take-offs, routes, holds and landings, or
/// none.
struct FlightStory {
  std::int64_t zero_ns = 0;  ///< CLOCK_MONOTONIC of the log's first tick, time 0
  std::vector<StoryPiece> pieces;
  /// Modes; commands, refusals, changes of the mode, maps, gaps of the VIO, what the daemon could not go on with. Times
  /// are since the log's first tick.
  report::Timeline timeline;
  std::vector<StorySample> samples;
  bool by_truth = false;         ///< positions are the truth's; otherwise those that the vehicle measured itself
  std::size_t beyond_truth = 0;  ///< ticks that a given truth does not cover: measured positions
  std::size_t take_offs = 0, landings = 0, holds = 0, refusals = 0;
  std::size_t judged = 0, inside = 0;
  double time_s = 0, length_m = 0;    ///< of the log; of the way in the air
  std::optional<double> clearance_m;  ///< least where it was judged; none without a map or a route
  JudgedMaps maps;                    ///< what that was judged by, and where it was not
  Vec3 largest_ratio = Vec3::Zero();  ///< largest |e|/h per axis
  std::string ended;                  ///< how the log ends, in words
  std::uint64_t records_lost = 0;
  tl::expected<log::Replay, log::LogError> replay;  ///< whether what it decided follows from what it was told
  std::optional<std::uint64_t> cut_at;              ///< byte from which on a last record was cut short
  std::vector<std::string> wrong;                   ///< why the flight was not good, the gravest first; empty: it was

  bool ok() const noexcept { return wrong.empty(); }
  bool goal_reached() const noexcept;  ///< each route that nobody ended was; false without one
  bool touched() const noexcept { return clearance_m.value_or(1) <= 0 || maps.beside_m.value_or(1) <= 0; }
};

/// Reads the story out of a raw log, whatever it holds. `vehicle`: for clearances to the maps in it (MapJudge).
/// `truth`: the bench's log of the same flight, columns t_s, x_m, y_m, z_m on the same monotonic clock; null: the
/// positions are those that the vehicle measured, and clearances hold up to the error of its estimate. The sets are
/// those that the daemon logged; nothing is propagated again. `because`: what ended the flight, as others saw it.
FlightStory flight_story(const log::RawLog& log, const Vehicle& vehicle, const log::FlightLog* truth = nullptr,
                         const std::string& because = "");

}  // namespace backwash::services

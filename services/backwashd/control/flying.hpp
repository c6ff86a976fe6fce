// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/plan/planner.hpp"
#include "core/track/tracker.hpp"

namespace backwash::daemon {

/// A segment with what is needed to verify it again and to continue it.
struct Flying {
  track::AcceptedSegment segment;
  State start;        ///< estimated when its first command was given
  Setpoint previous;  ///< command active before that
  plan::PlanMetrics metrics;
  std::optional<double> z_safe;  ///< of a take-off: below it only what is beside counts, m
  bool held = false;             ///< told to hold: a loop closure moves the map alone, not the vehicle

  bool clear() const noexcept { return segment.clearance > segment.apart_m; }
};

constexpr std::size_t kStopEvery = 10;  ///< commands (0.2 s) between verified stops

/// Smallest clearance (m) of the sets from number `from` on, swept through the world.
double clearance_from(const Flying& flying, const plan::World& world, const reach::ReachTube& tube, std::size_t from);

/// Propagates the segment's tube from its start through the world to rest, and takes its clearance from command `now`
/// on: clear() then says whether it may fly. One propagation: milliseconds.
void verify(Flying& flying, const plan::World& world, std::size_t now = 0);

/// Adds to a verified segment what guards it in flight: the stops that leave it at command `now` or later, every 0.2 s,
/// one propagation each, and the clearance of what is ahead from each second on.
void add_guards(Flying& flying, const plan::World& world, std::size_t now = 0);

/// The commands as they are flown: those of the segment, or, braking, of its stop that leaves at `stop_branch`.
std::vector<Setpoint> flown_commands(const Flying& flying, bool braking, std::size_t stop_branch);

/// Makes the flight's own way from command `branch` on, which comes to rest, one of its stops: where no other is clear
/// it still has one.
void add_own_stop(Flying& flying, std::size_t branch);
/// The same every 0.2 s from there until it rests, wherever no other stop leaves it: whoever asks for a stop while it
/// slows down already finds one.
void add_own_stops(Flying& flying, std::size_t branch);

/// The segment as the raw log's record (log::SegmentRecord, then the commands).
std::vector<std::uint8_t> segment_record(const Flying& flying);

}  // namespace backwash::daemon

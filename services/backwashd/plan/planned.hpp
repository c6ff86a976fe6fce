// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>

#include "core/adapt/in_flight.hpp"
#include "core/sync/handover.hpp"
#include "core/sync/latest_value.hpp"
#include "core/sync/record_ring.hpp"
#include "core/track/flight_tick.hpp"
#include "services/backwashd/clock.hpp"
#include "services/backwashd/in/received.hpp"
#include "services/backwashd/text.hpp"

namespace backwash::daemon {

/// What the mission asks the planner for. It plans in the newest world.
struct PlanJob {
  enum class Kind { takeoff, go_to, brake } kind = Kind::takeoff;
  std::uint64_t id = 0;
  Vec3 position = Vec3::Zero();  ///< goal; take-off: z counts
  std::optional<double> yaw;     ///< heading at the goal, rad; none: as the path leads there
  track::Epoch epoch;            ///< that it was asked for in: it is not done in another
};

/// How a job ended.
struct PlanOutcome {
  std::uint64_t job = 0;
  bool ok = false;
  std::array<char, 160> reason{};  ///< one line when not ok
};

/// Written by the mission and the planner.
struct Planned {
  sync::RecordRing<adapt::AirOrder, 16> air_orders;  // mission → control
  sync::RecordRing<track::Order, 64> orders;         // mission → control
  sync::Handover<PlanJob> jobs;                      // mission → planner
  sync::RecordRing<PlanOutcome, 16> outcomes;        // planner → mission
  sync::Handover<track::AcceptedSegment> segments;   // planner → control
  std::atomic<std::uint64_t> blocked_segment{0};     // planner → control: not clear in the newest world
  std::atomic<std::uint64_t> rough_segment{0};       // the same, in the air as the flight has learnt it
  sync::LatestValue<Line> place;                     // mission → status: what keeps it from flying from here
  AtomicTime enable_asked_ns;                        // mission → control: when an operator last asked to enable
  sync::LatestValue<CommandId> accepted;             // mission → status: the newest command that was
  sync::LatestValue<Line> task;                      // mission → status: of the last command
};

}  // namespace backwash::daemon

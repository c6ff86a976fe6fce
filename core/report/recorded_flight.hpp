// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "core/log/flight_log.hpp"
#include "core/log/raw_log.hpp"
#include "core/plan/world.hpp"
#include "core/sim/flight.hpp"

namespace backwash::report {

/// The map that the daemon flew with: the last one it accepted. Error: bad_data if there is none or it cannot be read.
tl::expected<map::OccupancyGrid, log::LogError> recorded_map(std::span<const log::RawRecord> log);
/// Whether this record holds a map that the daemon accepted.
bool accepted_map(const log::RawRecord& record) noexcept;
/// The map of such a record. Errors: bad_data.
tl::expected<map::OccupancyGrid, log::LogError> recorded_map(const log::RawRecord& accepted);

/// A flight of the daemon (take-off, then one route), put together from its raw log and the bench's log of the truth
/// (columns of backwash-bench --log; same monotonic clock). The tubes are propagated again from the logged states and
/// commands; what the daemon logged of them at each tick must agree, and the error against them is judged again at
/// every tick of a segment. Errors: bad_data naming what is missing or disagrees.
tl::expected<sim::Flight, log::LogError> recorded_flight(std::span<const log::RawRecord> log,
                                                         const log::FlightLog& truth, const plan::World& world);

}  // namespace backwash::report

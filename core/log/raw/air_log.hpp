// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/adapt/in_flight.hpp"
#include "core/log/raw/raw_log.hpp"
#include "core/track/flight_tick.hpp"

/// What a flight learns of its air in the raw log: the daemon and a replay decide every update by the same code.
namespace backwash::log {

CalmAirConstantsRecord constants(const adapt::InFlightConstants& constants) noexcept;
/// The same again, bit for bit; what is not in an AirConstantsRecord alone is as it was before there was more. Nothing:
/// no number, or one out of its range.
std::optional<adapt::InFlightConstants> decode(const RawRecord& record) noexcept;

/// Whether a tick adds anything: its set-point is flown, off the ground. Real-time: wait-free, no allocation.
bool flown(const track::TickInput& in, const track::TickOutput& out) noexcept;

/// What was learnt ends with the flight, when the vehicle is disarmed, but for what is kept; whether a factor changed.
/// Real-time: wait-free, no allocation.
bool ended(adapt::InFlight& air, const track::TickInput& in) noexcept;

/// Adds a tick that was flown() to what is learnt, with Σ and class of the record, and writes what was decided into it;
/// whether a factor changed. Real-time: wait-free, no allocation.
bool learn(adapt::InFlight& air, const track::TickInput& in, const track::FlightTick& flight,
           const track::TickOutput& out, AirRecord& record) noexcept;

/// That a class is rougher than modelled: of the martingale and of the detector (docs/model.md 7-6, 7-7) the larger
/// one, each over what it takes. 0 is none, 1 is enough.
double evidence(const AirRecord& record, double alpha) noexcept;

/// Does what the record's order asks in this tick, unless it lets sets shrink that may be flown: a reset of an armed
/// vehicle. Writes what was decided into the record; whether a factor changed. Precondition: its order is one.
/// Real-time: wait-free, no allocation.
bool carry_out(adapt::InFlight& air, const track::TickInput& in, AirOrderRecord& record) noexcept;

}  // namespace backwash::log

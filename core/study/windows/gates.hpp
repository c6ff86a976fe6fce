// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "core/study/windows/gate.hpp"
#include "core/study/windows/series.hpp"
#include "core/study/windows/stretch.hpp"

namespace backwash::study {

/// Whether the log says what the vehicle was told or what its rotors gave. If not, nothing simulates its own manoeuvres
/// and a − a_sim is a residual in hover alone.
bool simulated(const Series& s);

/// Whether the vehicle goes somewhere in the window: faster than 0.12 m/s over half a second.
bool under_way(const Series& s, Stretch w);

/// Why a window is left out: frozen; perched (no motion, no thrust, rotors told to rest in some row, or less than 5 mm
/// above `stood_z_m`, where a recording says it stood); transit (under way, not simulated, and without motor commands,
/// which could be compared all the same); saturated; inconsistent (position and velocity). Nothing if it is good.
std::optional<Gate> gate(const Series& s, const log::FlightLog& log, Stretch w);

}  // namespace backwash::study

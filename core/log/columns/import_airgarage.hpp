// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "core/log/columns/flight_log.hpp"

namespace backwash::log {

/// Reads one airgarage file (motion capture alone: t, x, y, z, qx … qw; 100 Hz frames, some missing, with the stamps of
/// their arrival) as a flight log.
///
/// Stamps: frames lie on a 10 ms grid; a frame that arrived late in a burst is put back before the next one. Velocity
/// and acceleration are those of local_cubics, so variances of these accelerations mean the band 0.2–4 Hz. Rows without
/// them are left out: a gap.
///
/// Four columns are added: `stood_z_m` (the marker's height while it stood at first), `surface_z_m` (what it stood on
/// then, the marker 27 mm above the feet), `ceiling` (−1: not said; labels say 1 hovering under a plate, 0 nothing
/// above) and `day` (date as yyyymmdd, from the file's name; flights after midnight keep their date). Errors: missing
/// file, columns or rows.
tl::expected<FlightLog, LogError> import_airgarage(const std::string& path);

}  // namespace backwash::log

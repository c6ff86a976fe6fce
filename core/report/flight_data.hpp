// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/plan/world/world.hpp"
#include "core/report/page/page_data.hpp"
#include "core/sim/flight.hpp"

namespace backwash::report {

/// What the figures of a judged flight show, as tables: path, tube, heights, error, clearance. Times are the
/// flight's own.
std::vector<DataTable> flight_tables(const sim::Flight& flight, const plan::World& world);
/// Where its route was flown, m.
std::vector<Vec3> route_of(const sim::Flight& flight);
/// Its path and tube in the map.
Scene flight_scene(const sim::Flight& flight, const plan::World& world);

}  // namespace backwash::report

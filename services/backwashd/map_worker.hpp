// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/types/model.hpp"
#include "core/types/vehicle.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/recorder.hpp"

namespace backwash::daemon {

/// Thread body: turns each map message into one immutable world (grid, distance, field, bounds, hover map). A map that
/// cannot be read is rejected whole, counted, and the old world stays (faults.md rows 11, 12).
void run_map_worker(Channels& channels, Recorder& recorder, const Model& model, const Vehicle& vehicle);

}  // namespace backwash::daemon

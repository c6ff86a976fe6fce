// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/log/columns/flight_log.hpp"
#include "core/study/windows/observation.hpp"
#include "core/study/windows/signals/series.hpp"
#include "core/study/windows/stretch.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::study {

/// Where and how a window was flown, and the air that the model has there; its flight and what is measured on it are
/// left to the Observer. Precondition: all of it is near() the surroundings.
WindowRow placed(const log::FlightLog& log, const Series& s, SampleRange w, const Vehicle& vehicle,
                 MapView& surroundings);

}  // namespace backwash::study

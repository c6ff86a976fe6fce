// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/study/windows/observation.hpp"
#include "core/types/vehicle.hpp"

/// What a change of tune, propeller, estimator or guard may have moved, by flight (docs/model.md 8-14).
namespace backwash::study {

/// Distance to the nearest surface and speed of a window, as octaves: what is flown in one cell is compared.
using Cell = std::pair<int, int>;

/// One number of a flight: of a window, or of the whole flight in the cell (0, 0).
struct MeasuredValue {
  std::size_t flight;
  Cell cell;
  double y;
};

/// A quantity of which less is better.
struct FlightMeasure {
  std::string name, unit;  ///< unit: of exp(y) where `ratio`, else of y
  bool ratio;              ///< y is the logarithm of the quantity: differences are ratios
  std::vector<MeasuredValue> values;
};

struct FlightMeasures {
  std::vector<FlightMeasure> tested;
  std::vector<FlightMeasure> flown = {};  ///< how the flights were flown, as a pilot or a plan has it: not the change
  std::vector<std::pair<std::string, std::string>> not_tested;  ///< name, why
};

/// Variance of acceleration by distance to the nearest surface, tracking error, loop latency (as of the vehicle file:
/// another gain shows in it too), vibration by octave, thrust command and battery of each flight; and how it was flown.
/// `logs`: those of `seen`, in its order, one or more. All but the last two are of the flights that are
/// logged as most are (columns, rate, set-points), since what is measured depends on that. O(rows · frequencies).
FlightMeasures measures_of(const Observations& seen, const std::vector<const log::FlightLog*>& logs,
                           const Vehicle& vehicle);

}  // namespace backwash::study

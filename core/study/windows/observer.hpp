// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/study/windows/observed.hpp"
#include "core/study/windows/signals/rotor_channels.hpp"
#include "core/study/windows/signals/series.hpp"
#include "core/study/windows/stretch.hpp"
#include "core/types/model.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::study {

/// Where and how a window was flown, and the air that the model has there; its flight and what is measured on it are
/// left to the Observer. Precondition: all of it is near() the surroundings.
WindowRow placed(const log::FlightLog& log, const Series& s, SampleRange w, const Vehicle& vehicle,
                 MapView& surroundings);

/// Adds a flight to the observations (gates, windows, channels). `grid` and `model` may be null: then no surfaces are
/// known but the floor at z = 0, and Σ = Σ_0. Real-time status: offline.
class Observer {
 public:
  Observer(const Vehicle& vehicle, const Model& model, const map::OccupancyGrid* grid);
  /// With surroundings that were looked at before, and are kept: studies of the same map share them.
  Observer(const Vehicle& vehicle, MapView& surroundings);
  Observer(const Observer&) = delete;
  void add(const log::FlightLog& log);
  /// Room for so many windows more: without it the vectors grow by doubling, and hold twice what is seen.
  void expect(std::size_t windows);
  /// Flights that another Observer of the same vehicle, model and map looked at, behind these.
  void add(Observed flights);
  /// Of the flights so far; none are left here.
  Observed take();
  Observations finish();
  /// As finish() would tell it now; more flights may be added.
  Observations so_far() const;

 private:
  void add_windows(const log::FlightLog& log, const Series& s, const RotorPhases& rotors,
                   const std::vector<SampleRange>& good);
  /// Why the map leaves a window out: far outside of it, or in a solid (map and log contradict each other).
  std::optional<Gate> misplaced(const Series& s, SampleRange w) const;
  Residual put_means(const WindowRow& row, const Series& s, SampleRange w);
  void put_spreads(const std::vector<Residual>& residuals, double rate_hz);
  void put(const ChannelValue& measured);
  void smooth_voltage();
  void put_tails();

  const Vehicle vehicle_;
  Observed all_;
  std::optional<MapView> own_;
  MapView& surroundings_;
};

}  // namespace backwash::study

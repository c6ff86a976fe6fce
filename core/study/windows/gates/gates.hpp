// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/study/windows/gates/gate.hpp"
#include "core/study/windows/gates/window_rules.hpp"
#include "core/study/windows/stretch.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::study {

/// Stretches of rows without a gap, t their times, s, rising. O(rows).
std::vector<SampleRange> unbroken(const std::vector<double>& t);
/// Windows of kWindowRules.window_length, to the nearest whole number in each stretch of one segment.
std::vector<SampleRange> cut(const Series& s);

/// What leaves a window out whatever it is for, calibration or study. The log must outlive it.
class LogGates {
 public:
  /// `rows`: those of the log that count, ascending, their times rising; needs x_m y_m z_m.
  LogGates(const log::FlightLog& log, std::vector<std::size_t> rows, const std::optional<Vehicle>& vehicle);

  /// Why a window is left out, the first that holds: frozen (the position repeats in some of its rows); perched (no
  /// motion, mean thrust far below what this log holds in the air, rotors told to rest in some row, or hardly above
  /// `stood_z_m`, where a recording says that it stood); saturated (a rotor command at either end). Nothing if it is
  /// good. O(rows of w).
  std::optional<Gate> operator()(SampleRange w) const;

 private:
  bool perched(SampleRange w) const;
  bool rotors_rest(SampleRange w) const;
  double share_of(double u) const;
  std::optional<double> hover_thrust() const;

  const log::FlightLog& log_;
  std::vector<std::size_t> rows_;
  std::optional<Vehicle> vehicle_;
  std::optional<double> hover_thrust_;                // the log's own, as thrust_share; without thrust none
  std::vector<char> frozen_;                          // per row
  std::vector<const std::vector<double>*> motors_;    // those that are logged
  std::vector<const std::vector<double>*> commands_;  // and the collective
};

/// Whether the log says what the vehicle was told or what its rotors gave. If not, nothing simulates its own manoeuvres
/// and a − a_sim is a residual in hover alone.
bool simulated(const Series& s);

/// Whether the vehicle goes somewhere in the window: faster than kWindowRules.still_speed over still_time.
bool under_way(const Series& s, SampleRange w);

/// What leaves a window out of a study beside LogGates: transit (under way, not simulated, and without motor commands,
/// which could be compared all the same); inconsistent (position and velocity). Nothing if it is good.
std::optional<Gate> unfit(const Series& s, const log::FlightLog& log, SampleRange w);

}  // namespace backwash::study

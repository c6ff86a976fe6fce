// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/study/windows/gates/window_rules.hpp"
#include "core/types/geometry.hpp"
#include "core/types/thrust.hpp"

namespace backwash::study {

/// By how much a delay or a lag may differ from the vehicle file's, s: where its design is computed.
inline constexpr std::array<double, 8> kShifts = {
    -2 * kWindowRules.shift_step, -1 * kWindowRules.shift_step, 0,
    kWindowRules.shift_step,      2 * kWindowRules.shift_step,  2 * kWindowRules.shift_far,
    3 * kWindowRules.shift_far,   4 * kWindowRules.shift_far};

/// A flight by sample, with what the simulation says of it (docs/interfaces.md, "Flight log, CSV").
struct Series {
  std::vector<double> t;           ///< s, from 0
  std::vector<std::size_t> row;    ///< the log's row of each sample
  std::vector<Vec3> p, v, a;       ///< W; a is differentiated where it is not logged
  std::vector<Vec3> a_sim;         ///< R_WB e_z T(thrust)/m − g e_z, or the closed loop's where thrust is missing
  std::vector<Mat3> R_WB;          ///< empty without attitude
  std::vector<double> thrust_acc;  ///< T/m, m/s²; empty without thrust
  /// Closed loop fed with the set-points alone; empty without set-points.
  std::vector<Vec3> p_nominal, v_nominal, a_nominal;
  std::vector<Vec3> v_dragged, a_dragged;  ///< of the same loop against a level drag of kWindowRules.loop_drag
  /// The same loop with an attitude that lags kWindowRules.more_lag longer.
  std::vector<Vec3> a_lagging;
  /// What the loop answers to the logged state and set-points, by an attitude lag that is kShifts longer; empty without
  /// set-points or attitude.
  std::array<std::vector<Vec3>, kShifts.size()> answer;
  std::vector<std::optional<int>> segment;  ///< hover position; none in transit or without the column
  bool simulated_by_thrust = false, has_velocity = false, has_acceleration = false;
  bool strayed = false;  ///< there are set-points, and most of the time the craft flew elsewhere: they count as none
  std::size_t size() const { return t.size(); }
};

/// Hover position of a value of the column `segment`; negative ones are transit.
std::optional<int> segment_of(double logged);

/// Reads a log. Rows must have growing stamps; those that do not are dropped. Positions must be there.
Series series_of(const log::FlightLog& log, const Vehicle& vehicle);

}  // namespace backwash::study

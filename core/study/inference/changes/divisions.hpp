// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "core/study/inference/rules.hpp"

/// Whether values of flights, in the order flown, lie on one level (docs/model.md section 8, "When").
namespace backwash::study {

/// How a cause changes from flight to flight, or within each.
enum class When : std::uint8_t {
  from,     ///< a flight on
  run,      ///< in flights behind each other
  any,      ///< in some flights
  steps,    ///< from one flight on, and again from another
  growing,  ///< as much from each flight to the next
  moment    ///< from a moment on in each flight
};
inline constexpr double kWhens = kRules.change_kinds;

/// One row per exchangeable parameter (the two level axes, else one), a column per flight, and the mean square error of
/// each column by the noise of its windows.
struct FlightValues {
  Eigen::MatrixXd of;
  Eigen::VectorXd error2;
};

/// What other amplitudes of these flights say of the scatter beforehand: that its square is `over` times that of the
/// windows' noise, as sure as of so many degrees of freedom.
struct Expected {
  double over = 1, degrees = 0;
};
/// By the moments of ln(scatter²/noise²) over amplitudes, as Smyth (Statistical Applications in Genetics and Molecular
/// Biology 3, 2004) has them; as sure as three such studies at most.
Expected expected(const std::vector<FlightValues>& amplitudes);

struct Division {
  When when;
  Eigen::MatrixXd profile;  ///< a row for each level that is added to the first, a column per flight; 0 … 1
  double p = 1;             ///< of values as different by chance, over all divisions of its kind
  double ways = 1;          ///< how many these are
  /// What is added by each row of the profile (a column each), its standard error, and the degrees of freedom of that.
  Eigen::MatrixXd added = {};
  Eigen::VectorXd error = {};
  double degrees = 0;
  Eigen::VectorXd level = {};  ///< where the profile is 0
  double level_error = 0;      ///< its standard error
};

/// The clearest division of each kind but `moment`; two steps only where each of them is clear beside the other. R² is
/// the share of the values' weighted square about their mean that a profile takes; p = ways · P(R² by chance), that of
/// Student's and Fisher's tests, and the scatter about the levels no less than the windows' noise. None with fewer than
/// fewest_divided flights.
std::vector<Division> divisions(const FlightValues& values, const Expected& expected = {});

/// What a profile (a row for each level) adds, one way.
Division division_of(const FlightValues& values, When when, const Eigen::MatrixXd& profile);

/// The same of values that are differences within flights: whether their mean is 0. `ways`: how many such were tried.
Division moment(const FlightValues& differences, double ways, const Expected& expected = {});

}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/study/inference/changes/amplitudes.hpp"
#include "core/study/inference/changes/changes.hpp"

/// Where and by how much a change acts, window by window.
namespace backwash::study {

struct Acting {
  std::vector<double> amount;  ///< per window, 0 … 1
  SmallVector theta, error;    ///< of the form's parameters where it is 1, and standard errors
  double degrees = 1;          ///< of freedom, of the errors
  bool stands_on = false;      ///< the flights without it are not as simulated
};

/// One for each row of the division's profile. A step between two flights may lie within one of them: at the window
/// where the step of the flight's own level is likelier than none by more than the windows tried and a ratio of 20.
/// What acts is called so that the other flights are nearer to the simulation; of rotors, to how craft are built.
/// `at`: of a moment, windows into each flight.
std::vector<Acting> acting_of(const Amplitudes& a, const Division& division, std::size_t at, const Observations& seen);

/// Columns times an amount per window.
std::vector<DesignColumn> masked(std::vector<DesignColumn> columns, const std::vector<double>& amount);

/// Flights with any amount; their first and last moments where it is not all along.
std::vector<ActingFlight> flights_of(const std::vector<double>& amount, const Observations& seen);

}  // namespace backwash::study

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace backwash::race {

/// Of maps and vehicles; empty: all.
struct Chosen {
  std::string map, vehicle;
};
/// Every way, some flights a plan; or risks alone: as many flights of a plan as its stated risk asks for, or one of
/// each plan by a risk of 1e-3.
enum class Flights { all, drawn, counted };
/// Plans and flies `pairs` pairs of each map, vehicle and speed a round, by these ways and in every air, and appends a
/// row a pair, air and way to `file`; what is there already is left out. Stops after `rounds`.
int fly_all(const std::string& file, std::size_t rounds, std::size_t pairs, const Chosen& only, Flights flights);

/// Verifies the trajectories of other planners in `folder`, or those through `places`, and flies them: a row each.
/// `scale`: by how much the worst case's tube may grow and stay clear; `risk`: of touching; `width`: of the tube, m.
int sieve(const std::string& file, const std::string& folder);

/// The clearance that is asked along others' trajectories after each step from the worst case to what touches: a table
/// a map and loop.
int print_factors(const std::string& folder);

/// How often the errors of real flights leave the levels of exit_level(), by flight and axis. NanoBench: about the
/// motion that a loop fitted to the other flights predicts. Hovers without set-points: about the mean of two seconds.
int judge_real_flights(const std::string& folder);

}  // namespace backwash::race

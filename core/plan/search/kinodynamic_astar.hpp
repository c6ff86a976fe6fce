// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/plan/world/safe_space.hpp"

namespace backwash::plan {

using Clock = std::chrono::steady_clock;
inline double ms_since(Clock::time_point t) {
  return std::chrono::duration<double, std::milli>(Clock::now() - t).count();
}

struct SearchOptions {
  double v_max;           ///< m/s per axis
  double a_max;           ///< m/s² per axis
  std::size_t max_nodes;  ///< states kept
  Clock::time_point deadline;
};

struct SearchFailure {
  /// no_path: nothing joins start and goal. infeasible: something does, but no motion within the limits from this
  /// start. exhausted: the cap of states was reached before an answer. deadline: the time was.
  enum class Kind { no_path, infeasible, exhausted, deadline } kind;
  std::string message;  ///< one line
};

/// A found path: motions that join with equal position and velocity; the last ends at rest exactly at the goal.
struct SearchResult {
  std::vector<Motion> motions;
  double cost;           ///< G = ∫‖u‖² dt + ρT, m²/s³
  double lower_bound;    ///< of the cost of any path, by the heuristic at the start
  std::size_t expanded;  ///< states expanded by all attempts
};

/// Hybrid-state A* (paper Sec. V-A, docs/model.md section 5b) over (p, v): acceleration grid × two durations, cost
/// G = ∫‖u‖² dt + ρT, each motion checked as a swept set and against the limits per axis, closed by the optimal cubic
/// to the goal. The open set is taken by bands of f = G + H as wide as H(start), so the cost is below twice the best of
/// the discretisation; inside a band greedily. A start faster than v_max may only slow down. Deterministic.
///
/// Attempts, each where the one before has not found a way: H = cost_to_go over the durations that the straight way
/// needs at least, for 1,000 states; then a way over blocks of voxels with stops, shortened by the quickest joins
/// (shortened_way), which exists wherever passable voxels join start and goal; then, only for a
/// start that cannot stop within passable voxels, H over the durations that the way through these needs
/// (SafeView::hops_to, least_stopping_time). Both H are admissible; the shortened way has no bound of its cost.
tl::expected<SearchResult, SearchFailure> search(const SafeView& space, const State& start, const Vec3& goal_W,
                                                 const SearchOptions& options);

/// Positions every `step` along the motions, both ends included: the step is shortened to divide the duration, and the
/// one used is returned with them.
struct PathSamples {
  std::vector<Vec3> positions;  ///< m
  double step;                  ///< s
};
PathSamples sample(const std::vector<Motion>& motions, double step);

}  // namespace backwash::plan

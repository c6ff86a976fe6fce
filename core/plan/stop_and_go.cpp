// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/stop_and_go.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::plan {
namespace {

/// The cubic from rest to rest has peaks 3/2 d/T of velocity and 6 d/T² of acceleration, on a straight line.
Motion line(const Vec3& from_W, const Vec3& to_W, double v_max, double a_max) {
  const double d = (to_W - from_W).cwiseAbs().maxCoeff();
  const double T = std::max({1.5 * d / v_max, std::sqrt(6 * d / a_max), kControlPeriod});
  return optimal_cubic({from_W, Vec3::Zero()}, to_W, T);
}

}  // namespace

std::vector<Motion> stop_and_go(const SafeView& space, const State& start, const Vec3& goal_W, double v_max,
                                double a_max) {
  std::vector<Motion> motions;
  Vec3 at_W = start.p_W;
  if (const double speed = start.v_W.cwiseAbs().maxCoeff(); speed > 0) {
    motions.push_back(primitive(start, -start.v_W * (a_max / speed), speed / a_max));
    if (!space.clear(motions.back())) return {};
    at_W = motions.back().end().p_W;
  }
  const auto chain = space.chain(space.space().index(at_W), space.space().index(goal_W));
  if (chain.empty()) return {};
  const std::size_t last = chain.size() - 1;
  const auto point = [&](std::size_t n) { return n == last ? goal_W : space.space().center(chain[n]); };
  if (last == 0) motions.push_back(line(at_W, goal_W, v_max, a_max));
  for (std::size_t reached = 0; reached < last;) {
    // The next voxel always works: a line between two neighbours stays in them.
    std::size_t step = last - reached;
    while (step > 1 && !space.clear(line(at_W, point(reached + step), v_max, a_max))) step = (step + 1) / 2;
    reached += step;
    motions.push_back(line(at_W, point(reached), v_max, a_max));
    at_W = point(reached);
  }
  return motions;
}

}  // namespace backwash::plan

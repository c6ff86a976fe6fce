// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/search/shortened_way.hpp"

#include <cstdint>
#include <utility>

namespace backwash::plan {

ShortenedWay shortened_way(const SafeView& space, const State& start, const Vec3& goal_W, const AxisLimits& limits,
                           double rho, std::chrono::steady_clock::time_point deadline) {
  constexpr double kBlocksPerStep = 1000, kFewSteps = 20;  // blocks of two voxels that are looked at before single ones
  const double speed = start.v_W.cwiseAbs().maxCoeff();
  const Vec3 from_W = start.p_W + start.v_W * (speed / (2 * limits.a_max));  // where braking ends
  ShortenedWay result{Way::Status::found, {}, 0, 0};
  if (!space.passable(space.space().index(from_W))) return result;
  for (const int edge : {2, 1}) {
    const double steps = (goal_W - from_W).cwiseAbs().maxCoeff() / (edge * space.space().resolution());
    const auto most = edge == 1 ? SIZE_MAX : static_cast<std::size_t>(kBlocksPerStep * (steps + kFewSteps));
    const Way way = way_over_blocks(space, from_W, goal_W, edge, most, deadline);
    result.status = way.status;
    result.expanded += way.expanded;
    if (way.status != Way::Status::found) continue;
    result.motions = along(space, start, way.points, limits);
    if (result.motions.empty()) continue;
    result.motions = shortened(space, std::move(result.motions), limits, rho);
    result.cost = cost_of(result.motions, rho);
    break;
  }
  return result;
}

}  // namespace backwash::plan

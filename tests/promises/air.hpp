// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "tests/promises/draw.hpp"

namespace backwash::promises {

/// A small world for a vehicle, with drawn air, and w̄ of every voxel as a plain table.
struct Air {
  /// Throws Broken if w̄ of some voxel is not that of docs/model.md sections 1 to 3 by loops over everything
  /// (tests/field/brute_force.hpp), times the factor of its class; std::invalid_argument for a loop that is refused.
  Air(Random& random, const Vehicle& vehicle);

  DrawnModel drawn;
  std::shared_ptr<const plan::World> world;
  std::vector<PerDirection> w;  // by linear index, m/s²

  /// A steady push is all that blows.
  bool calm() const { return drawn.model.base.horizontal == 0; }
  /// The largest w̄ of the voxels that meet a box, by looking at each.
  PerDirection largest(const Vec3& low, const Vec3& high) const;
  /// Demands of some steps of a tube that their bound is that over their own set. With an integrator (`charged`, its
  /// answers level and vertical): that it is not below mean + κ deviations of gusts less what is held of them.
  void demand_bounds(const reach::ReachTube& tube, const std::vector<Answer>& charged, Random& random) const;

 private:
  void demand_field(Random& random) const;
};

}  // namespace backwash::promises

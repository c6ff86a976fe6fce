// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "core/reach/reach_tube.hpp"

namespace backwash::reach {

/// A box along the axes of W.
struct TubeBox {
  Vec3 low, high;  ///< m
};

/// A tube as boxes to be shown, at most so many: each lies around the sets of all steps that it stands for, until the
/// next of them, as wide as they are along x, y and z. `most`: 1 or more.
std::vector<TubeBox> tube_boxes(const ReachTube& tube, std::size_t most);

}  // namespace backwash::reach

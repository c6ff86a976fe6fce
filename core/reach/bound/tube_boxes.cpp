// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/bound/tube_boxes.hpp"

#include <algorithm>
#include <limits>

namespace backwash::reach {

std::vector<TubeBox> tube_boxes(const ReachTube& tube, std::size_t most) {
  std::vector<TubeBox> boxes;
  const std::size_t each = (tube.size() + most - 1) / most;
  for (std::size_t from = 0; from < tube.size(); from += each) {
    TubeBox box{Vec3::Constant(std::numeric_limits<double>::infinity()), {}};
    box.high = -box.low;
    for (std::size_t n = from; n < std::min(from + each, tube.size()); ++n) {
      const auto& h = tube[n].half_widths_interval;
      const Vec3 half(h[kX], h[kY], h[kZ]);
      box.low = box.low.cwiseMin(tube[n].center.p_W - half);
      box.high = box.high.cwiseMax(tube[n].center.p_W + half);
    }
    boxes.push_back(box);
  }
  return boxes;
}

}  // namespace backwash::reach

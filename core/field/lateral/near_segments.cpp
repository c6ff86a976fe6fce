// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/lateral/near_segments.hpp"

#include <algorithm>
#include <cstdlib>

#include "core/field/lateral/lateral_kernels.hpp"

namespace backwash::field {

void NearSegments::reserve(std::size_t most) {
  if (number.size() >= most) return;
  number.resize(2 * most);
  dx.resize(2 * most);
  dy.resize(2 * most);
  m_x.resize(2 * most);
  m_y.resize(2 * most);
  along.resize(2 * most);
  flat2.resize(2 * most);
  decay.resize(2 * most);
}

void NearSegments::find(const LateralColumns& columns, int x, int y, int low, int high) {
  const int radius = columns.radius_;
  const Index3& size = columns.grid_->size();
  const Standing standing{columns.x_.data(), columns.low_.data(), columns.high_.data(), columns.m_x_.data(),
                          columns.m_y_.data()};
  Looking looking{x, 0, low, high, static_cast<float>(columns.range2_ + 0.01)};
  count = 0;
  for (looking.dy = std::max(-y, -radius); looking.dy <= std::min(size.y() - 1 - y, radius); ++looking.dy) {
    const int half = columns.half_width_[static_cast<std::size_t>(std::abs(looking.dy))];
    if (half < 0) continue;
    const auto* column = columns.column_first_.data() + static_cast<std::ptrdiff_t>(y + looking.dy) * size.x();
    const std::uint32_t first = column[std::max(0, x - half)], end = column[std::min(size.x(), x + half + 1)];
    reserve(count + end - first + 2 * kEight);
    const std::size_t more = find_near(standing, first, end, looking, number.data() + count);
    for (std::size_t n = count; n < count + more; ++n) {
      const auto& s = columns.segments_[number[n]];
      dx[n] = s.x - x;
      dy[n] = looking.dy;
      m_x[n] = s.m_x;
      m_y[n] = s.m_y;
    }
    count += more;
  }
  const double a = columns.grid_->resolution();
  see({dx.data(), dy.data(), m_x.data(), m_y.data(), along.data(), flat2.data(), decay.data()}, padded(count),
      columns.model_.wall.k2 * a * a);
}

}  // namespace backwash::field

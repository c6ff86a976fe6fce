// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/sight/sight_path.hpp"

#include <algorithm>
#include <cmath>

#include "core/field/sight/sight.hpp"

namespace backwash::field {

std::vector<Index3> cells_on_path(const Index3& o, const Vec3& face) {
  std::vector<Index3> cells;
  const Vec3 c = o.cast<double>() + face;
  const auto segment = open_part(Vec3::Constant(-0.5), 1, Vec3::Zero(), c);
  if (!segment) return cells;
  const double t_end = segment->delta.norm() / c.norm();
  int u = 0;
  c.cwiseAbs().maxCoeff(&u);
  const int v = (u + 1) % 3, w = (u + 2) % 3, along = c[u] < 0 ? -1 : 1, slabs = std::abs(o[u]);
  const double length = std::abs(c[u]);
  const auto cell = [](double x) { return floor_to_int(x + 0.5); };
  for (int s = slabs; s >= 0; --s) {
    const double t0 = std::max(0.0, (s - 0.5 - 2 * kTouch) / length);
    const double t1 = std::min(t_end, (s + 0.5 + 2 * kTouch) / length);
    if (t0 > t1) continue;
    const auto first = [&](int axis) { return cell(std::min(t0 * c[axis], t1 * c[axis]) - 2 * kTouch); };
    const auto last = [&](int axis) { return cell(std::max(t0 * c[axis], t1 * c[axis]) + 2 * kTouch); };
    Index3 at;
    at[u] = along * s;
    for (at[v] = first(v); at[v] <= last(v); ++at[v])
      for (at[w] = first(w); at[w] <= last(w); ++at[w])
        if (!at.isZero() && meets(*segment, at)) cells.push_back(at);
  }
  return cells;
}

}  // namespace backwash::field

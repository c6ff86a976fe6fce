// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/sight_path.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/field/sight.hpp"

namespace backwash::field {
namespace {

/// The points t·(o + m/2), 0 ≤ t ≤ t_end, for all m of a range: per axis, t·low ≤ x ≤ t·high.
struct Beam {
  Vec3 low, high;
  Vec3 per_low, per_high;  // reciprocals
  double t_end;
};

Beam beam_to(const Index3& o, const NormalRange& normals) {
  const Vec3 low = o.cast<double>() + 0.5 * normals.low, high = o.cast<double>() + 0.5 * normals.high;
  const double longest = low.cwiseAbs().cwiseMax(high.cwiseAbs()).norm();
  return {low, high, low.cwiseInverse(), high.cwiseInverse(), longest > 2 + kTouch ? 1 - 2 / longest : -1};
}

/// Whether some point of the beam lies in the closed box of voxel v: slabs whose sides move with t.
bool meets(const Beam& beam, const Index3& v) {
  double enter = 0, leave = beam.t_end;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = v[axis] - 0.5 - kTouch, high = v[axis] + 0.5 + kTouch;
    const double fast = beam.high[axis], slow = beam.low[axis];
    const double low_fast = low * beam.per_high[axis], high_slow = high * beam.per_low[axis];
    if (fast > 0) enter = std::max(enter, low_fast);  // t·fast ≥ low
    if (fast < 0) leave = std::min(leave, low_fast);
    if (slow > 0) leave = std::min(leave, high_slow);  // t·slow ≤ high
    if (slow < 0) enter = std::max(enter, high_slow);
    if ((fast == 0 && low > 0) || (slow == 0 && high < 0)) return false;
  }
  return enter <= leave;
}

}  // namespace

std::optional<NormalRange> facing_normals(const Index3& o, const Index3& face) noexcept {
  constexpr double kSlack = 1e-9, kPi = std::numbers::pi;
  const double distance = std::hypot(o.x(), o.y());
  if (distance <= 0.5) return std::nullopt;
  // As angles about the middle of the facing arc, which is shorter than a half circle.
  const double middle = std::atan2(-o.y(), -o.x()), half = std::acos(0.5 / distance) + kSlack;
  const double of_face = std::remainder(std::atan2(face.y(), face.x()) - middle, 2 * kPi);
  const double first = middle + std::max(-half, of_face - kPi / 4 - kSlack);
  const double last = middle + std::min(half, of_face + kPi / 4 + kSlack);
  if (first > last) return std::nullopt;
  NormalRange range{Vec3(1, 1, 0), Vec3(-1, -1, 0)};
  const auto take = [&](double angle) {
    const Vec3 m(std::cos(angle), std::sin(angle), 0);
    range.low = range.low.cwiseMin(m), range.high = range.high.cwiseMax(m);
  };
  take(first), take(last);
  for (int quarter = -4; quarter <= 4; ++quarter)  // the arc's extremes along x and y
    if (const double angle = quarter * kPi / 2; first <= angle && angle <= last) take(angle);
  return range;
}

std::vector<Index3> cells_on_path(const Index3& o, const NormalRange& normals) {
  std::vector<Index3> cells;
  const Beam beam = beam_to(o, normals);
  if (beam.t_end < 0) return cells;
  int u = 0;
  o.cwiseAbs().maxCoeff(&u);
  const int v = (u + 1) % 3, w = (u + 2) % 3, along = o[u] < 0 ? -1 : 1, slabs = std::abs(o[u]);
  const double slow = std::min(std::abs(beam.low[u]), std::abs(beam.high[u]));
  const double fast = std::max(std::abs(beam.low[u]), std::abs(beam.high[u]));
  const auto cell = [](double x) { return floor_to_int(x + 0.5); };
  for (int s = slabs; s >= 0; --s) {
    const double t0 = std::max(0.0, (s - 0.5 - 2 * kTouch) / fast);
    const double t1 = slow > 0 ? std::min(beam.t_end, (s + 0.5 + 2 * kTouch) / slow) : beam.t_end;
    if (t0 > t1) continue;
    const auto first = [&](int axis) { return cell(std::min(t0 * beam.low[axis], t1 * beam.low[axis]) - 2 * kTouch); };
    const auto last = [&](int axis) { return cell(std::max(t0 * beam.high[axis], t1 * beam.high[axis]) + 2 * kTouch); };
    Index3 at;
    at[u] = along * s;
    for (at[v] = first(v); at[v] <= last(v); ++at[v])
      for (at[w] = first(w); at[w] <= last(w); ++at[w])
        if (!at.isZero() && meets(beam, at)) cells.push_back(at);
  }
  return cells;
}

}  // namespace backwash::field

// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/scan/scan.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace backwash::map {

LiveMap::LiveMap(OccupancyGrid grid)
    : grid_(std::move(grid)), misses_(grid_.cell_count(), 0), seen_(grid_.cell_count(), Seen::nothing) {}

void LiveMap::see(const Index3& v, Seen what) {
  if (!grid_.inside(v)) return;
  const std::size_t n = grid_.linear(v);
  if (seen_[n] == Seen::nothing) touched_.push_back(n);
  seen_[n] = std::max(seen_[n], what);
}

// Voxel by voxel along the segment: always over the face that comes first. The number of steps is that of the faces
// between both ends, so rounding cannot make it run past the end.
void LiveMap::pass(const Vec3& from, const Vec3& to) {
  Index3 v = from.array().floor().cast<int>();
  const Index3 last = to.array().floor().cast<int>();
  const Vec3 way = to - from;
  Index3 sign;
  Vec3 next, between;  // share of the segment: until the next face and between faces, per axis
  for (int i = 0; i < 3; ++i) {
    sign[i] = last[i] >= v[i] ? 1 : -1;
    const bool moves = last[i] != v[i];
    next[i] = moves ? (v[i] + (sign[i] > 0) - from[i]) / way[i] : std::numeric_limits<double>::infinity();
    between[i] = moves ? sign[i] / way[i] : 0;
  }
  for (int steps = (last - v).cwiseAbs().sum(); steps > 0; --steps) {
    see(v, Seen::passed);
    int axis = 0;
    next.minCoeff(&axis);
    v[axis] += sign[axis];
    next[axis] = v[axis] == last[axis] ? std::numeric_limits<double>::infinity() : next[axis] + between[axis];
  }
}

void LiveMap::take_along(const LiveMap& other, const Index3& low) noexcept {
  for_each_voxel(all_of(grid_.size()), [&](const Index3& v) {
    if (!other.found(low + v)) return;
    grid_.set(v, Cell::occupied);
    misses_[grid_.linear(v)] = kFound;
  });
}

ScanChange LiveMap::insert(std::span<const Vec3> points_W, const Vec3& sensor_W, double max_range, int misses) {
  ScanChange change;
  const double a = grid_.resolution();
  const Vec3 sensor = (sensor_W - grid_.origin()) / a;
  for (const Vec3& p : points_W) {
    const double range = (p - sensor_W).norm();
    if (!std::isfinite(range)) continue;
    const bool hit = range <= max_range;
    const Vec3 end = hit ? p : Vec3(sensor_W + max_range / range * (p - sensor_W));
    pass(sensor, (end - grid_.origin()) / a);
    if (hit) see(grid_.index(p), Seen::hit);
  }
  for (const std::size_t n : touched_) {
    const Cell before = grid_.at(n);
    Cell now = before;
    if (seen_[n] == Seen::hit) {
      now = Cell::occupied;
      misses_[n] = kFound;
    } else if (before != Cell::occupied || (++misses_[n] & ~kFound) >= misses) {
      now = Cell::free;
      misses_[n] = 0;
    }
    seen_[n] = Seen::nothing;
    if (now == before) continue;
    const Index3 v = grid_.voxel(n);
    grid_.set(v, now);
    change.box.add(v);
    if (now == Cell::occupied) change.occupied.push_back(v);
  }
  touched_.clear();
  return change;
}

}  // namespace backwash::map

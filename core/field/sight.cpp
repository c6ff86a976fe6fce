// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/sight.hpp"

#include <algorithm>

namespace backwash::field {

std::optional<Segment> open_part(const Vec3& origin_W, double voxel_edge, const Vec3& p_W, const Vec3& c_W) noexcept {
  const double inverse_edge = 1 / voxel_edge;
  const Vec3 delta = (c_W - p_W) * inverse_edge;
  const double length = delta.norm();
  if (length <= 2 + kTouch) return std::nullopt;
  return Segment{(p_W - origin_W) * inverse_edge, delta * (1 - 2 / length)};
}

bool meets(const Segment& segment, const Index3& voxel) noexcept {
  double enter = 0, leave = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = voxel[axis] - kTouch - segment.from[axis], high = voxel[axis] + 1 + kTouch - segment.from[axis];
    const double d = segment.delta[axis];
    if (d == 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    const double t0 = low / d, t1 = high / d;
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  return enter <= leave;
}

bool line_of_sight(const map::OccupancyGrid& grid, const Vec3& p_W, const Vec3& c_W) noexcept {
  const auto segment = open_part(grid.origin(), grid.resolution(), p_W, c_W);
  return !segment || clear(*segment, [&](const Index3& v) { return grid.occupied(v) ? 0 : 1; });
}

SightMap::Viewpoint SightMap::viewpoint(const Vec3& p_W) const noexcept {
  const Vec3 x =
      ((p_W - origin_W_) / resolution_).cwiseMax(-1.0).cwiseMin(Vec3(nx_, ny_, nz_));  // within the int range
  return {p_W, empty_radius(Index3(x.array().floor().cast<int>()))};
}

bool SightMap::line_of_sight(const Viewpoint& from, const Vec3& c_W) const noexcept {
  const auto segment = open_part(origin_W_, resolution_, from.p_W, c_W);
  return !segment || clear(
                         *segment, [this](const Index3& v) { return empty_radius(v); }, from.empty_radius);
}

namespace {

/// One sweep of the two-pass chessboard distance transform over a box of nx × ny × nz bytes, forward or backward: every
/// voxel becomes at most 1 more than the smallest of the 13 neighbours already swept. Two sweeps make it exact: a
/// shortest chessboard path can be ordered so that the steps of one mask come first. Capped at 255.
void sweep(std::vector<std::uint8_t>& radius, std::ptrdiff_t nx, std::ptrdiff_t ny, std::ptrdiff_t nz, bool forward) {
  const std::ptrdiff_t back = forward ? -1 : 1;
  const auto row_of = [&](std::ptrdiff_t y, std::ptrdiff_t z) { return radius.data() + nx * (y + ny * z); };
  std::vector<std::uint8_t> nearest(static_cast<std::size_t>(nx) + 2);  // over the four rows swept, padded by one
  for (std::ptrdiff_t n = 0; n < ny * nz; ++n) {
    const std::ptrdiff_t m = forward ? n : ny * nz - 1 - n, y = m % ny, z = m / ny;
    std::fill(nearest.begin(), nearest.end(), 255);
    const auto take = [&](std::ptrdiff_t row_y, std::ptrdiff_t row_z) {
      if (row_y < 0 || row_y >= ny || row_z < 0 || row_z >= nz) return;
      const std::uint8_t* row = row_of(row_y, row_z);
      for (std::ptrdiff_t x = 0; x < nx; ++x) {
        auto& least = nearest[static_cast<std::size_t>(x + 1)];
        least = std::min(least, row[x]);
      }
    };
    take(y + back, z);
    for (std::ptrdiff_t dy = -1; dy <= 1; ++dy) take(y + dy, z + back);
    std::uint8_t* row = row_of(y, z);
    int previous = 255;
    for (std::ptrdiff_t i = 0; i < nx; ++i) {
      const std::ptrdiff_t x = forward ? i : nx - 1 - i;
      const auto* around = nearest.data() + x;
      const int least = std::min({around[0], around[1], around[2], static_cast<std::uint8_t>(previous)});
      row[x] = static_cast<std::uint8_t>(std::min<int>(row[x], least + 1));
      previous = row[x];
    }
  }
}

}  // namespace

SightMap::SightMap(const map::OccupancyGrid& grid)
    : origin_W_(grid.origin()),
      resolution_(grid.resolution()),
      nx_(static_cast<unsigned>(grid.size().x())),
      ny_(static_cast<unsigned>(grid.size().y())),
      nz_(static_cast<unsigned>(grid.size().z())),
      radius_(grid.cell_count()) {
  std::ranges::transform(grid.cells(), radius_.begin(),
                         [](map::Cell c) { return c == map::Cell::occupied ? std::uint8_t{0} : std::uint8_t{255}; });
  sweep(radius_, nx_, ny_, nz_, true);
  sweep(radius_, nx_, ny_, nz_, false);
}

}  // namespace backwash::field

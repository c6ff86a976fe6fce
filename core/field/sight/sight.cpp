// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/sight/sight.hpp"

#include <algorithm>

namespace backwash::field {

std::optional<LineSegment> open_part(const Vec3& origin_W, double voxel_edge, const Vec3& p_W,
                                     const Vec3& c_W) noexcept {
  const double inverse_edge = 1 / voxel_edge;
  const Vec3 delta = (c_W - p_W) * inverse_edge;
  const double length = delta.norm();
  if (length <= 2 + kTouch) return std::nullopt;
  return LineSegment{(p_W - origin_W) * inverse_edge, delta * (1 - 2 / length)};
}

bool meets(const LineSegment& line, const Index3& voxel) noexcept {
  double enter = 0, leave = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = voxel[axis] - kTouch - line.from[axis], high = voxel[axis] + 1 + kTouch - line.from[axis];
    const double d = line.delta[axis];
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

SightMap::Viewpoint SightMap::viewpoint(const Vec3& p_W) const noexcept {
  const Vec3 x =
      ((p_W - origin_W_) / resolution_).cwiseMax(-1.0).cwiseMin(Vec3(nx_, ny_, nz_));  // within the int range
  return {p_W, empty_radius(Index3(x.array().floor().cast<int>()))};
}

bool SightMap::line_of_sight(const Viewpoint& from, const Vec3& c_W) const noexcept {
  const auto line = open_part(from, c_W);
  return !line || clear(from, *line);
}

bool SightMap::clear(const Viewpoint& from, const LineSegment& line) const noexcept {
  const Vec3 to = line.from + line.delta;
  return empty(line.from.cwiseMin(to), line.from.cwiseMax(to)) ||
         field::clear(
             line, [this](const Index3& v) { return empty_radius(v); }, from.empty_radius);
}

bool SightMap::empty(const Vec3& low, const Vec3& high) const noexcept {
  constexpr double kReach = 2 * kTouch;
  const auto bound = [](double x, unsigned n) {
    return x <= 0 ? std::size_t{0} : x >= n ? std::size_t{n} : static_cast<std::size_t>(x);
  };
  const std::size_t row = nx_ + 1, layer = row * (ny_ + 1);
  const std::size_t x0 = bound(low.x() - kReach, nx_), x1 = bound(high.x() + kReach + 1, nx_);
  const std::size_t y0 = row * bound(low.y() - kReach, ny_), y1 = row * bound(high.y() + kReach + 1, ny_);
  const std::size_t z0 = layer * bound(low.z() - kReach, nz_), z1 = layer * bound(high.z() + kReach + 1, nz_);
  const auto column = [&](std::size_t y, std::size_t z) { return sums_[x1 + y + z] - sums_[x0 + y + z]; };
  return column(y1, z1) + column(y0, z0) == column(y0, z1) + column(y1, z0);
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
  add_up();
}

void SightMap::add_up() {
  const std::size_t row = nx_ + 1, layer = row * (ny_ + 1);
  sums_.assign(layer * (nz_ + 1), 0);
  const std::uint8_t* radius = radius_.data();
  for (std::size_t z = 1; z <= nz_; ++z)
    for (std::size_t y = 1; y <= ny_; ++y) {
      std::uint32_t* sums = sums_.data() + z * layer + y * row;
      const std::uint32_t *before = sums - row, *below = sums - layer, *both = below - row;
      std::uint32_t in_row = 0;
      for (std::size_t x = 1; x <= nx_; ++x) {
        in_row += *radius++ == 0 ? 1 : 0;
        sums[x] = in_row + before[x] + below[x] - both[x];
      }
    }
}

}  // namespace backwash::field

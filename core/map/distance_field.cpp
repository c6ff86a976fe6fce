// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/distance_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/map/lattice.hpp"

namespace backwash::map {
namespace {

// Squared distances are integers in units of half a voxel, so the transform is exact. On a line, voxel i has its centre
// at 2i + 1 and face j lies at 2j.
using Squared = std::uint32_t;  // at most (2·32768 − 1)²: the nearest side of the grid is never farther

/// Work space for one line of n voxels.
struct Line {
  explicit Line(std::size_t n) : cost(n), face(n + 1), vertex(n + 1), from(n + 1) {}
  std::vector<std::int64_t> cost;    // of the voxels: squared distance in the axes done so far
  std::vector<std::int64_t> face;    // of the faces: the cheaper of the two voxels that share it
  std::vector<std::int64_t> vertex;  // lower envelope: position 2j of its parabolas …
  std::vector<std::int64_t> from;    // … and where each starts to be the lowest
};

/// In place: cost[i] ← min over voxels k of cost[k] + d(i, k)², d from i's centre to k's box. For k ≠ i that box is met
/// at a face, so the minimum over all faces plus voxel i itself is enough, and the faces' parabolas have the usual
/// lower envelope. Beyond both ends lie obstacles: the outermost faces cost nothing.
void add_axis(Line& line) {
  const std::size_t n = line.cost.size();
  line.face[0] = line.face[n] = 0;
  for (std::size_t j = 1; j < n; ++j) line.face[j] = std::min(line.cost[j - 1], line.cost[j]);

  std::size_t last = 0;
  line.vertex[0] = 0;
  line.from[0] = 0;
  const auto height = [&](std::int64_t x, std::int64_t q) {
    return (x - q) * (x - q) + line.face[static_cast<std::size_t>(q / 2)];
  };
  const auto end = static_cast<std::int64_t>(2 * n);
  for (std::int64_t q = 2; q <= end; q += 2) {
    std::int64_t start = 0;
    bool empty = false;
    while (height(line.from[last], line.vertex[last]) > height(line.from[last], q)) {
      if (last == 0) {
        empty = true;
        break;
      }
      --last;
    }
    if (!empty) {
      const std::int64_t p = line.vertex[last];
      const std::int64_t rise = q * q - p * p + line.face[static_cast<std::size_t>(q / 2)] -
                                line.face[static_cast<std::size_t>(p / 2)];  // ≥ 0: q loses or ties where p starts
      start = 1 + rise / (2 * (q - p));
      if (start >= end) continue;
      ++last;
    }
    line.vertex[last] = q;
    line.from[last] = start;
  }
  for (std::size_t i = n; i-- > 0;) {
    const auto x = static_cast<std::int64_t>(2 * i + 1);
    while (line.from[last] > x) --last;
    line.cost[i] = std::min(line.cost[i], height(x, line.vertex[last]));
  }
}

/// First axis: distance along each x row to the nearest obstacle in that row.
void start_rows(const OccupancyGrid& grid, std::vector<Squared>& squared) {
  const auto nx = static_cast<std::size_t>(grid.size().x());
  const auto cells = grid.cells();
  const auto square = [](std::size_t steps) {
    const auto d = static_cast<Squared>(steps == 0 ? 0 : 2 * std::min<std::size_t>(steps, 32768) - 1);
    return d * d;
  };
  for (std::size_t row = 0; row < cells.size(); row += nx) {
    std::size_t steps = 0;
    for (std::size_t i = 0; i < nx; ++i) {
      steps = cells[row + i] == Cell::free ? steps + 1 : 0;
      squared[row + i] = square(steps);
    }
    steps = 0;
    for (std::size_t i = nx; i-- > 0;) {
      steps = cells[row + i] == Cell::free ? steps + 1 : 0;
      squared[row + i] = std::min(squared[row + i], square(steps));
    }
  }
}

void transform_line(std::vector<Squared>& squared, std::size_t begin, std::size_t stride, Line& line) {
  for (std::size_t i = 0, k = begin; i < line.cost.size(); ++i, k += stride) line.cost[i] = squared[k];
  add_axis(line);
  for (std::size_t i = 0, k = begin; i < line.cost.size(); ++i, k += stride) {
    squared[k] = static_cast<Squared>(line.cost[i]);
  }
}

/// The eight centres around a point and its position between them.
struct Corners {
  std::array<double, 8> d;  // bit 0: upper in x, bit 1: y, bit 2: z
  Vec3 t;                   // 0 … 1
};

Corners corners(const DistanceField& field, const Vec3& q) noexcept {
  const Vec3 floor = (q.array() - 0.5).floor();
  const Index3 base = floor.cast<int>();
  Corners c{{}, q - Vec3::Constant(0.5) - floor};
  for (int i = 0; i < 8; ++i) c.d[static_cast<std::size_t>(i)] = field.at(base + Index3(i & 1, i >> 1 & 1, i >> 2));
  return c;
}

double mix(double a, double b, double t) noexcept { return a + (b - a) * t; }

/// Gap between coordinate q and the interval [i, i + 1].
double gap(double q, int i) noexcept { return std::max({i - q, q - (i + 1), 0.0}); }

}  // namespace

DistanceField::DistanceField(const OccupancyGrid& grid)
    : origin_W_(grid.origin()), resolution_(grid.resolution()), size_(grid.size()), distance_(grid.cell_count()) {
  std::vector<Squared> squared(grid.cell_count());
  start_rows(grid, squared);
  const auto nx = static_cast<std::size_t>(size_.x());
  const auto ny = static_cast<std::size_t>(size_.y());
  const auto nz = static_cast<std::size_t>(size_.z());
  Line along_y(ny);
  for (std::size_t k = 0; k < nz; ++k) {
    for (std::size_t i = 0; i < nx; ++i) transform_line(squared, i + nx * ny * k, nx, along_y);
  }
  Line along_z(nz);
  for (std::size_t column = 0; column < nx * ny; ++column) transform_line(squared, column, nx * ny, along_z);
  std::transform(squared.begin(), squared.end(), distance_.begin(), [this](Squared s) {
    return static_cast<float>(0.5 * resolution_ * std::sqrt(static_cast<double>(s)));
  });
}

double DistanceField::at(const Index3& v) const noexcept {
  return inside(size_, v) ? static_cast<double>(distance_[linear(size_, v)]) : 0.0;
}

bool DistanceField::covers(const Vec3& q) const noexcept {
  return (q.array() >= 0.0).all() && (q.array() < size_.cast<double>().array()).all();  // false for NaN
}

double DistanceField::interpolated(const Vec3& p_W) const noexcept {
  const Vec3 q = (p_W - origin_W_) / resolution_;
  if (!covers(q)) return 0.0;
  const auto [d, t] = corners(*this, q);
  return mix(mix(mix(d[0], d[1], t.x()), mix(d[2], d[3], t.x()), t.y()),
             mix(mix(d[4], d[5], t.x()), mix(d[6], d[7], t.x()), t.y()), t.z());
}

Vec3 DistanceField::gradient(const Vec3& p_W) const noexcept {
  const Vec3 q = (p_W - origin_W_) / resolution_;
  if (!covers(q)) return Vec3::Zero();
  const auto [d, t] = corners(*this, q);
  const Vec3 per_voxel(mix(mix(d[1] - d[0], d[3] - d[2], t.y()), mix(d[5] - d[4], d[7] - d[6], t.y()), t.z()),
                       mix(mix(d[2] - d[0], d[3] - d[1], t.x()), mix(d[6] - d[4], d[7] - d[5], t.x()), t.z()),
                       mix(mix(d[4] - d[0], d[5] - d[1], t.x()), mix(d[6] - d[2], d[7] - d[3], t.x()), t.y()));
  return per_voxel / resolution_;
}

double DistanceField::exact(const OccupancyGrid& grid, const Vec3& p_W) const noexcept {
  const Vec3 q = (p_W - origin_W_) / resolution_;  // from here on in voxels
  if (!covers(q)) return 0.0;
  const Index3 v = q.array().floor().cast<int>();
  if (!grid.free(v)) return 0.0;

  // The distance is 1-Lipschitz, so at() bounds the search; the surplus covers the rounding of the stored float.
  const double reach = at(v) / resolution_ + (q - v.cast<double>() - Vec3::Constant(0.5)).norm();
  double best = std::min({q.minCoeff(), (size_.cast<double>() - q).minCoeff(), reach * (1 + 1e-6)});
  best *= best;
  const double radius = std::sqrt(best);
  const Index3 low = (q.array() - radius).floor().cast<int>().max(0);
  const Index3 high = (q.array() + radius).floor().cast<int>().min(size_.array() - 1);
  for (int k = low.z(); k <= high.z(); ++k) {
    const double dz = gap(q.z(), k);
    for (int j = low.y(); j <= high.y(); ++j) {
      const double dy = gap(q.y(), j);
      const double off_row = dz * dz + dy * dy;
      if (off_row >= best) continue;
      for (int i = low.x(); i <= high.x();) {
        if (!grid.free({i, j, k})) {
          const double dx = gap(q.x(), i);
          best = std::min(best, off_row + dx * dx);
          ++i;
        } else {  // an obstacle n voxels along the row is n − 1/2 away from this centre: none before that
          i += std::max(1, static_cast<int>(std::ceil(at({i, j, k}) / resolution_ + 0.5 - 1e-3)));
        }
      }
    }
  }
  return std::sqrt(best) * resolution_;
}

}  // namespace backwash::map

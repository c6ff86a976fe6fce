// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/clearance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace backwash::reach {
namespace {

using Vec2 = Eigen::Vector2d;

/// Supports of the octagon {|x| ≤ x, |y| ≤ y, |x + y| ≤ sum, |x − y| ≤ difference} and the half height z of the prism.
/// Tight: each is attained. Only then do supports add in a Minkowski sum, and do they give the corners.
struct Supports {
  double x, y, z, sum, difference;
};

/// Duality: the largest value in a direction is the least combination of two slabs whose normals enclose it.
Supports tight_supports(const PerDirection& h) noexcept {
  const double sqrt2 = std::sqrt(2.0);
  const double x = h[kX], y = h[kY], s = sqrt2 * h[kXyPlus], d = sqrt2 * h[kXyMinus];
  return {std::min({x, s + y, d + y, (s + d) / 2}), std::min({y, s + x, d + x, (s + d) / 2}), h[kZ],
          std::min({s, x + y, d + 2 * x, d + 2 * y}), std::min({d, x + y, s + 2 * x, s + 2 * y})};
}

/// The octagon ⊕ a rectangle, that of a voxel or a larger one, around the origin. Lengths in voxels.
class FatOctagon {
 public:
  explicit FatOctagon(const Supports& s, double half_x = 0.5, double half_y = 0.5) noexcept
      : x_(s.x + half_x), y_(s.y + half_y), sum_(s.sum + half_x + half_y), difference_(s.difference + half_x + half_y) {
    // Half of the corners, counter-clockwise from the right edge's lower end; the others are their mirror images.
    corners_ = {Vec2{x_, x_ - difference_}, Vec2{x_, sum_ - x_}, Vec2{sum_ - y_, y_}, Vec2{y_ - difference_, y_},
                Vec2{-x_, difference_ - x_}};
  }
  /// Largest violation of a side: at most the distance, 0 inside. Cheap.
  double separation(const Vec2& p) const noexcept {
    const double diagonal = std::max(std::abs(p.x() + p.y()) - sum_, std::abs(p.x() - p.y()) - difference_);
    return std::max({0.0, std::abs(p.x()) - x_, std::abs(p.y()) - y_, diagonal / std::sqrt(2.0)});
  }
  double squared_distance(const Vec2& p) const noexcept {
    if (separation(p) == 0) return 0;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c + 1 < corners_.size(); ++c) {
      nearest = std::min(
          {nearest, to_segment(p, corners_[c], corners_[c + 1]), to_segment(-p, corners_[c], corners_[c + 1])});
    }
    return nearest;
  }

 private:
  static double to_segment(const Vec2& p, const Vec2& from, const Vec2& to) noexcept {
    const Vec2 along = to - from, r = p - from;
    const double length2 = along.squaredNorm();
    const double t = length2 > 0 ? std::clamp(r.dot(along) / length2, 0.0, 1.0) : 0.0;
    return (r - t * along).squaredNorm();
  }
  double x_, y_, sum_, difference_;
  std::array<Vec2, 5> corners_;
};

bool eight_free(const map::Cell* cells) noexcept {
  static_assert(sizeof(map::Cell) == 1);
  constexpr std::uint64_t kAllFree = 0x0101010101010101u * static_cast<std::uint64_t>(map::Cell::free);
  std::uint64_t word = 0;
  std::memcpy(&word, cells, 8);
  return word == kAllFree;
}

/// First cell of [from, to) that is not free, or `to`.
const map::Cell* first_obstacle(const map::Cell* from, const map::Cell* to) noexcept {
  while (to - from >= 8 && eight_free(from)) from += 8;
  while (from < to && *from == map::Cell::free) ++from;
  return from;
}

/// Whether all of [from, to) are free; the last word may overlap the one before.
bool all_free(const map::Cell* from, const map::Cell* to) noexcept {
  if (to - from < 8) return first_obstacle(from, to) == to;
  for (; to - from > 8; from += 8) {
    if (!eight_free(from)) return false;
  }
  return eight_free(to - 8);
}

/// Last cell of [from, to) that is not free, or `to`.
const map::Cell* last_obstacle(const map::Cell* from, const map::Cell* to) noexcept {
  const map::Cell* c = to;
  while (c - from >= 8 && eight_free(c - 8)) c -= 8;
  while (c > from && *(c - 1) == map::Cell::free) --c;
  return c > from ? c - 1 : to;
}

/// Search for the obstacle nearest to a prism: voxels from the centre outwards, so that what is found early shortens
/// the rest. Lengths are in voxels, from the grid's origin. Precondition: the prism lies inside the grid.
class Scan {
 public:
  /// Nothing beyond `limit` matters, and nothing else once an obstacle is found that is no farther than `enough`.
  /// With `sums`, layers without obstacles are skipped.
  Scan(const map::OccupancyGrid& grid, const map::OccupancySums* sums, const Vec3& center, const Supports& s,
       double limit, double enough)
      : grid_(grid),
        sums_(sums),
        center_(center),
        half_(s.x, s.y, s.z),
        under_from_(std::max(0, static_cast<int>(center.x() - s.x))),
        under_to_(std::min(grid.size().x(), static_cast<int>(center.x() + s.x) + 1)),
        octagon_(s),
        nearest2_(limit * limit),
        enough2_(enough * enough) {}

  /// Squared distance; the squared limit if nothing is nearer; 0 if enough was found.
  double nearest2() {
    const auto layer = [&](int k, double gap2_z) {
      outwards(1, gap2_z, [&](int j, double gap2_y) { row(j, k, gap2_y, gap2_z); });
    };
    if (!sums_) {
      outwards(2, 0, layer);
      return nearest2_;
    }
    // Up and down from the middle layer; of the layers with obstacles the nearer one first.
    const int top = grid_.size().z() - 1, middle = std::clamp(static_cast<int>(center_.z()), 0, top);
    int up = first_with_obstacle(middle, 1), down = first_with_obstacle(middle - 1, -1);
    while (nearest2_ > 0 && (up <= top || down >= 0)) {
      const bool upwards = down < 0 || (up <= top && gap2(2, up) <= gap2(2, down));
      int& next = upwards ? up : down;
      layer(next, gap2(2, next));
      next = first_with_obstacle(upwards ? next + 1 : next - 1, upwards ? 1 : -1);
      int& other = upwards ? down : up;
      if (gap2(2, other) >= nearest2_) other = upwards ? -1 : top + 1;
    }
    return nearest2_;
  }

 private:
  /// Squared gap along an axis between the prism and the voxels with this index.
  double gap2(int axis, int index) const noexcept {
    const double gap = std::max({0.0, index - center_[axis] - half_[axis], center_[axis] - half_[axis] - index - 1});
    return gap * gap;
  }
  /// Visits the layers of an axis whose gap, with `others2` in the other axes, is less than the nearest so far.
  template <class Visit>
  void outwards(int axis, double others2, const Visit& visit) {
    // From a centre outside of the grid (or not finite: damaged logs) the nearest face's layer comes first.
    const int size = grid_.size()[axis];
    const int middle = static_cast<int>(std::max(-1.0, std::min(static_cast<double>(size), center_[axis])));
    bool nearer = true;
    const auto layer = [&](int n) {
      if (n < 0 || n >= size) return;
      const double g = gap2(axis, n);
      if (others2 + g >= nearest2_) return;
      nearer = true;
      visit(n, g);
    };
    for (int up = middle, down = middle - 1; nearer; ++up, --down) {
      nearer = false;
      layer(up);
      layer(down);
    }
  }
  /// The first layer from k on, upwards or downwards, that holds an obstacle within a box around what is nearer than
  /// the nearest so far; -1 or the number of layers if there is none. By halves.
  int first_with_obstacle(int k, int step) const noexcept {
    const int size = grid_.size().z(), none = step > 0 ? size : -1;
    const double reach = std::sqrt(nearest2_);
    const Vec3 far = half_ + Vec3::Constant(reach);
    const Index3 low = (center_ - far).cwiseMax(0).cast<int>();
    const Index3 high = (center_ + far).cwiseMin(grid_.size().cast<double>() - Vec3::Ones()).cast<int>();
    const auto free = [&](int from, int to) {
      return sums_->voxels_free({low.x(), low.y(), std::min(from, to)}, {high.x(), high.y(), std::max(from, to)});
    };
    int last = step > 0 ? high.z() : low.z();
    if ((last - k) * step < 0 || free(k, last)) return none;
    while (k != last) {
      const int half = k + (last - k) / 2;
      if (free(k, half))
        k = half + step;
      else
        last = half;
    }
    return k;
  }
  /// A row of voxels along x. Distance is convex in x: it only grows beyond the prism's bounding box, so that on either
  /// side of it the first obstacle is enough.
  void row(int j, int k, double gap2_y, double gap2_z) {
    const map::Cell* const cells = grid_.cells().data() + grid_.linear(Index3(0, j, k));
    const auto consider = [&](const map::Cell* c) {
      const Vec2 p(static_cast<double>(c - cells) + 0.5 - center_.x(), j + 0.5 - center_.y());
      const double separation = octagon_.separation(p);
      if (separation * separation + gap2_z >= nearest2_) return;
      nearest2_ = std::min(nearest2_, octagon_.squared_distance(p) + gap2_z);
      if (nearest2_ <= enough2_) nearest2_ = 0;  // ends all loops
    };
    const auto range_from = [&](double reach) { return cells + std::max(0, static_cast<int>(center_.x() - reach)); };
    const auto range_to = [&](double reach) {
      return cells + std::min(grid_.size().x(), static_cast<int>(center_.x() + reach) + 1);
    };
    const double widest = half_.x() + std::sqrt(nearest2_ - gap2_y - gap2_z);
    if (all_free(range_from(widest), range_to(widest))) return;  // most rows
    const map::Cell *const under = cells + under_from_, *const right = cells + under_to_;
    for (const map::Cell* c = first_obstacle(under, right); c != right; c = first_obstacle(c + 1, right)) consider(c);
    if (nearest2_ <= gap2_y + gap2_z) return;
    const double reach = half_.x() + std::sqrt(nearest2_ - gap2_y - gap2_z);
    const map::Cell *const from = range_from(reach), *const to = range_to(reach);
    if (const map::Cell* c = first_obstacle(right, to); c != to) consider(c);
    if (const map::Cell* c = last_obstacle(from, under); c != under) consider(c);
  }

  const map::OccupancyGrid& grid_;
  const map::OccupancySums* sums_;
  Vec3 center_, half_;
  int under_from_, under_to_;  // columns that the prism's bounding box meets
  FatOctagon octagon_;
  double nearest2_, enough2_;
};

/// Supports of the prism around the middle of a motion that holds the prism all along it; `half`: half the motion.
Supports swept_supports(const PerDirection& half_widths, const Vec3& half) noexcept {
  Supports s = tight_supports(half_widths);
  s.x += std::abs(half.x());
  s.y += std::abs(half.y());
  s.z += std::abs(half.z());
  s.sum += std::abs(half.x() + half.y());
  s.difference += std::abs(half.x() - half.y());
  return s;
}

double distance(const map::OccupancyGrid& grid, const Vec3& center_W, const Supports& s, double limit,
                const map::OccupancySums* sums = nullptr, double enough = 0) {
  const double a = grid.resolution();
  const Vec3 center = (center_W - grid.origin()) / a;
  const Supports in_voxels{s.x / a, s.y / a, s.z / a, s.sum / a, s.difference / a};
  // The outside is the complement of a box: six half-spaces.
  const Vec3 to_side =
      center.cwiseMin(grid.size().cast<double>() - center) - Vec3(in_voxels.x, in_voxels.y, in_voxels.z);
  const double outside = to_side.minCoeff();
  if (!(a * outside > enough)) return 0;
  const double nearest2 = Scan(grid, sums, center, in_voxels, std::min(limit / a, outside), enough / a).nearest2();
  return std::min(limit, a * std::sqrt(nearest2));
}

}  // namespace

double body_and_estimation(const Vehicle& vehicle) noexcept {
  return vehicle.body.radius + vehicle.estimation.position;
}

double circumradius(const PerDirection& half_widths) noexcept {
  const Supports s = tight_supports(half_widths);
  const double side = std::max(std::abs(s.sum - s.x), std::abs(s.difference - s.x)),
               end = std::max(std::abs(s.sum - s.y), std::abs(s.difference - s.y));
  return std::sqrt(std::max(s.x * s.x + side * side, s.y * s.y + end * end) + s.z * s.z);
}

// A voxel is a box, so its distance to the prism is that of its centre to prism ⊕ box, whose supports are the sums.
double prism_distance(const map::OccupancyGrid& grid, const Vec3& center_W, const PerDirection& half_widths,
                      double limit, const map::OccupancySums* sums) {
  return distance(grid, center_W, tight_supports(half_widths), limit, sums);
}

bool prism_clear(const map::OccupancyGrid& grid, const map::OccupancySums& sums, const Vec3& center_W,
                 const PerDirection& half_widths, double least) {
  return distance(grid, center_W, tight_supports(half_widths), least + 1e-9, &sums, least) > least;
}

double swept_prism_distance(const map::OccupancyGrid& grid, const Vec3& from_W, const Vec3& to_W,
                            const PerDirection& half_widths, double limit) {
  const Vec3 half = (to_W - from_W) / 2;
  return distance(grid, from_W + half, swept_supports(half_widths, half), limit);
}

std::size_t first_blocked(std::span<const TubeStep> tube, std::size_t from, const Cube& cube, double taken) noexcept {
  if (tube.empty()) return 0;
  for (std::size_t n = std::min(from, tube.size() - 1); n < tube.size(); ++n) {
    const TubeStep& step = tube[n];
    const Vec3& to = tube[std::min(n + 1, tube.size() - 1)].center.p_W;
    const Vec3 half = (to - step.center.p_W) / 2;
    const Vec3 off = (cube.center - step.center.p_W - half).cwiseAbs();
    const Vec3 box(step.half_widths_interval[kX], step.half_widths_interval[kY], step.half_widths_interval[kZ]);
    // Farther away along an axis than counts: most entries.
    const Vec3 half_cube = Vec3::Constant(cube.edge / 2) + cube.more / 2;
    const Vec3 gap = off - half.cwiseAbs() - box - half_cube;
    if (gap.maxCoeff() > taken) continue;
    const Supports s = swept_supports(step.half_widths_interval, half);
    const double a = cube.edge, above = std::max(0.0, off.z() - s.z - half_cube.z());
    const FatOctagon octagon({s.x / a, s.y / a, 0, s.sum / a, s.difference / a}, 0.5 + cube.more.x() / (2 * a),
                             0.5 + cube.more.y() / (2 * a));
    const Vec3 p = cube.center - step.center.p_W - half;
    const double beside2 = a * a * octagon.squared_distance(p.head<2>() / a);
    if (beside2 + above * above <= taken * taken) return n;
  }
  return tube.size();
}

}  // namespace backwash::reach

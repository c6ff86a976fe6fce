// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/field/surface.hpp"

namespace backwash::field {

/// Where the elements that may act on a vehicle at p lie: in a ball about p, or in a vertical column through p cut by a
/// larger ball.
/// The ball's part outside the column may be cut to a cone that opens downwards from p.
struct Reach {
  double ball = 0;                        ///< radius, m
  double column_radius = 0;               ///< m
  double column_length = 0;               ///< radius of the larger ball, m
  std::optional<double> cone_slope = {};  ///< horizontal over vertical extent of the cone, where there is one
};

/// Elements sorted into cubes so that those near a point are found without looking at the others.
class ElementBuckets {
 public:
  ElementBuckets(const map::OccupancyGrid& grid, std::vector<Element> elements);

  /// Calls visit(element) for every element within the reach of p (and few beyond) that p is in front of,
  /// m·(p − c) > 0, in a fixed order.
  template <typename Visit>
  void for_each_near(const Vec3& p_W, const Reach& reach, const Visit& visit) const {
    const double horizontal = std::max(reach.ball, reach.column_radius) + kSlack;
    const double vertical = std::max(reach.ball, reach.column_length) + kSlack;
    const auto squared = [](double x) { return (x + kSlack) * (x + kSlack); };
    const double ball2 = squared(reach.ball), column2 = squared(reach.column_radius),
                 length2 = squared(reach.column_length);
    const bool cone = reach.cone_slope.has_value();
    const double slope2 = cone ? *reach.cone_slope * *reach.cone_slope : 0;
    const Vec3 extent(horizontal, horizontal, vertical);
    const Index3 low = bucket_of(p_W - extent), high = bucket_of(p_W + extent);
    for (int j = low.y(); j <= high.y(); ++j)
      for (int i = low.x(); i <= high.x(); ++i) {
        const double gap_x = gap(p_W, i, 0), gap_y = gap(p_W, j, 1);
        const double flat = std::sqrt(gap_x * gap_x + gap_y * gap_y);
        if (flat > horizontal) continue;
        const double half_chord = std::sqrt(std::max(0.0, ball2 - flat * flat));
        const double half =
            flat <= reach.column_radius + kSlack ? std::max(half_chord, reach.column_length + kSlack) : half_chord;
        const int k0 = bucket_of(p_W - Vec3(0, 0, half)).z(), k1 = bucket_of(p_W + Vec3(0, 0, half)).z();
        // Buckets of one column are neighbours in memory: one run of elements.
        const std::size_t begin = first_[column(i, j) + static_cast<std::size_t>(k0)];
        const std::size_t end = first_[column(i, j) + static_cast<std::size_t>(k1) + 1];
        for (std::size_t n = begin; n < end; ++n) {
          const auto& [c_W, normal] = places_[n];
          const Vec3 r = c_W - p_W;
          if (r.dot(normal) >= -kInPlane) continue;
          const double flat2 = r.x() * r.x() + r.y() * r.y(), r2 = flat2 + r.z() * r.z();
          const bool in_ball = r2 <= ball2 && (!cone || (r.z() < kSlack && flat2 <= slope2 * r.z() * r.z() + kSlack));
          if (in_ball || (flat2 <= column2 && r2 <= length2)) visit(elements_[n]);
        }
      }
  }

 private:
  static constexpr double kEdge = 0.5;    // m
  static constexpr double kSlack = 1e-6;  // m, more than the tolerance of the gates
  static constexpr double kInPlane =
      1e-9;  // m: a point in an element's own plane does not see it, whatever the rounding
  struct Place {
    Vec3 c_W, normal;
  };

  /// Nearest bucket that holds elements' positions; clamped, so that it exists for any finite p.
  Index3 bucket_of(const Vec3& p_W) const noexcept {
    const Vec3 b = ((p_W - origin_W_) / kEdge).cwiseMax(0.0).cwiseMin((count_.array() - 1).cast<double>().matrix());
    return b.cast<int>();
  }
  /// Distance along one axis from p to a bucket's slab, m.
  double gap(const Vec3& p_W, int bucket, int axis) const noexcept {
    const double low = origin_W_[axis] + kEdge * bucket - p_W[axis];
    return std::max({0.0, low, -low - kEdge});
  }
  std::size_t column(int i, int j) const noexcept {
    return (static_cast<std::size_t>(j) * static_cast<std::size_t>(count_.x()) + static_cast<std::size_t>(i)) *
           static_cast<std::size_t>(count_.z());
  }

  Vec3 origin_W_;
  Index3 count_;
  std::vector<Element> elements_;
  std::vector<Place> places_;       ///< of the elements: all that most of them are asked for, half of the memory
  std::vector<std::size_t> first_;  ///< bucket n holds elements first_[n] … first_[n + 1] − 1
};

}  // namespace backwash::field

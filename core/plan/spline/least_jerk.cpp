// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/spline/least_jerk.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/reach/clearance.hpp"

namespace backwash::plan {

namespace {

constexpr std::size_t kSamples = 4;      ///< per knot span
constexpr double kPenalty = 50;          ///< λ: of a bound broken by 1 m, over a third difference of 1 m
constexpr int kRounds = 6, kSteps = 12;  ///< of bounds, of Newton's steps under the same bounds
constexpr int kFree = 2;      ///< rounds whose half-spaces go: between two walls each round would push to the other one
constexpr int kHalvings = 5;  ///< of a step
constexpr double kSettled = 0.02;       ///< m that control points still move by in a round
constexpr double kSettledStep = 0.002;  ///< and in a step
constexpr double kFar = 0.5;            ///< m beyond what is asked: obstacles there are not seen
constexpr double kExact = 0.3;          ///< m: nearer than this a flown set's clearance is measured with its prism

using Points = Eigen::Matrix<double, 3, Eigen::Dynamic>;

/// low ≤ n·Σ_k w_k q_{first+k} ≤ high; n is a unit vector.
struct Bound {
  Eigen::Index first;
  std::array<double, 4> w;
  Vec3 n;
  double low, high;
  double value = 0, slope = 0;  ///< now, and along a step
  double excess(double share) const noexcept {
    const double x = value + share * slope;
    return x - std::clamp(x, low, high);
  }
};

/// A symmetric positive definite matrix in which four neighbouring control points meet: its lower diagonals, by
/// columns.
class Banded {
 public:
  explicit Banded(std::size_t n) : columns_(n) {}
  std::size_t size() const noexcept { return columns_.size(); }
  /// Entry (row, column), row ≥ column.
  double& operator()(std::size_t row, std::size_t column) noexcept { return columns_[column][row - column]; }
  /// The solution of A x = b, in place of b; A becomes its factors L D Lᵀ.
  void solve(std::vector<double>& b) noexcept {
    const std::size_t n = size();
    for (std::size_t j = 0; j < n; ++j)
      for (std::size_t k = 1; k <= below(j); ++k) {
        const double l = columns_[j][k] / columns_[j][0];
        if (l == 0) continue;
        for (std::size_t i = k; i <= kBelow; ++i) columns_[j + k][i - k] -= l * columns_[j][i];
        b[j + k] -= l * b[j];
      }
    for (std::size_t j = n; j-- > 0;) {
      for (std::size_t k = 1; k <= below(j); ++k) b[j] -= columns_[j][k] * b[j + k];
      b[j] /= columns_[j][0];
    }
  }

 private:
  static constexpr std::size_t kBelow = 11;
  std::size_t below(std::size_t column) const noexcept { return std::min(kBelow, size() - 1 - column); }
  std::vector<std::array<double, kBelow + 1>> columns_;
};

Vec3 sum(const Points& q, Eigen::Index first, const std::array<double, 4>& w) noexcept {
  Vec3 p = w[0] * q.col(first) + w[1] * q.col(first + 1) + w[2] * q.col(first + 2);
  if (w[3] != 0) p += w[3] * q.col(first + 3);
  return p;
}

/// Support of the octagonal prism along a unit direction: of the two horizontal faces next to it, and z.
double prism_support(const PerDirection& h, const Vec3& n) noexcept {
  const double x = std::abs(n.x()), y = std::abs(n.y());
  return std::abs(x - y) * h[x >= y ? kX : kY] +
         std::sqrt(2.0) * std::min(x, y) * h[n.x() * n.y() >= 0 ? kXyPlus : kXyMinus] + std::abs(n.z()) * h[kZ];
}

class Newton {
 public:
  Newton(const World& world, const BSpline& curve, const Flown* flown, double margin, const MotionLimits& limits,
         bool norm)
      : world_(world),
        norm_(norm),
        taken_(reach::body_and_estimation(world.reach.vehicle) + world.constant_margin.value_or(0.0) + margin),
        q_(3, static_cast<Eigen::Index>(curve.control_points.size())),
        jerk_(static_cast<std::size_t>(3 * free())) {
    for (Eigen::Index i = 0; i < q_.cols(); ++i) q_.col(i) = curve.control_points[static_cast<std::size_t>(i)];
    std::vector<double> none(jerk_.size());
    for (Eigen::Index first = 0; first + 3 < q_.cols(); ++first)
      for (int axis = 0; axis < 3; ++axis) add(jerk_, none, {first, kThird, Vec3::Unit(axis), 0, 0}, 0, 1);
    const double span = curve.knot_span;
    for (Eigen::Index i = 2; i + 3 < q_.cols(); ++i)
      bound_each_axis(i, {-1, 1}, span * limits.velocity(static_cast<std::size_t>(i), span));
    for (Eigen::Index i = 1; i + 3 < q_.cols(); ++i) bound_each_axis(i, {1, -2, 1}, span * span * limits.a);
    lasting_ = bounds_.size();
    if (flown) measure(*flown);
  }

  LeastJerk run(BSpline curve) {
    look_around();
    for (int round = 0; round < kRounds && free() > 0; ++round) {
      const Points before = q_;
      minimise();
      if (round >= kFree) lasting_ = bounds_.size();
      const Points wanted = q_;
      for (double share = 1; share > 0.1 && !(q_ = before + share * (wanted - before), look_around()); share /= 2) {
      }
      if ((q_ - before).cwiseAbs().maxCoeff() < kSettled) break;
    }
    for (Eigen::Index i = 0; i < q_.cols(); ++i) curve.control_points[static_cast<std::size_t>(i)] = q_.col(i);
    return {std::move(curve), steps_};
  }

 private:
  static constexpr std::array<double, 4> kThird{-1, 3, -3, 1};
  /// What a flown set is beside its command.
  struct Sample {
    Vec3 off;        ///< of its centre, m
    PerDirection h;  ///< m
    double more;     ///< clearance than its support leaves, m
  };

  Eigen::Index free() const noexcept { return q_.cols() - 6; }
  void bound_each_axis(Eigen::Index first, const std::array<double, 4>& w, const Vec3& limit) {
    for (int axis = 0; axis < 3; ++axis) bounds_.push_back({first, w, Vec3::Unit(axis), -limit[axis], limit[axis]});
  }
  template <class Visit>
  bool all_samples(const Points& q, const Visit& visit) const {
    std::size_t n = 0;
    for (std::size_t sample = 0; sample < kSamples; ++sample) {
      const auto w = weights(4, 1, static_cast<double>(sample) / kSamples, 0).weight;
      for (Eigen::Index first = 0; first + 3 < q.cols(); ++first, ++n)
        if (!visit(n, first, w, static_cast<double>(first) + static_cast<double>(sample) / kSamples)) return false;
    }
    return true;
  }

  void measure(const Flown& flown) {
    all_samples(q_, [&](std::size_t, Eigen::Index, const auto&, double knots) {
      const double t = knots * flown.curve.knot_span;
      const auto k = std::min(static_cast<std::size_t>(std::lround(t / kControlPeriod)), flown.tube.size() - 2);
      const Vec3 &p = flown.tube[k].center.p_W, &next = flown.tube[k + 1].center.p_W;
      const PerDirection h = world_.constant_margin ? PerDirection{} : flown.tube[k].half_widths_interval;
      const auto [distance, gradient] = world_.distance.linear(p);
      const double left = distance - taken_ - (gradient.norm() > 0 ? support(h, gradient.normalized()) : 0);
      double more = 0;
      if (left < kExact && !norm_) {
        const double exact = reach::swept_prism_distance(world_.grid, p, next, h, taken_ + kExact);
        // A set that meets an obstacle does so by an unknown depth: the support says more then.
        if (exact > 0) more = exact - taken_ - left;
      }
      flown_.push_back({p - flown.curve.derivative(static_cast<double>(k) * kControlPeriod, 0), h, more});
      return true;
    });
  }
  double support(const PerDirection& h, const Vec3& n) const noexcept {
    return norm_ ? Vec3(h[kX], h[kY], h[kZ]).norm() : prism_support(h, n);
  }
  PerDirection hover_set(const Vec3& p) const noexcept {
    PerDirection h{};
    if (world_.constant_margin) return h;
    const DisturbanceBound bound = world_.bounds.at(world_.grid.index(p));
    for (std::size_t d = 0; d < kDirections; ++d)
      h[d] = bound.w[d] * (d == kZ ? world_.reach.vertical.h_inf : world_.reach.horizontal.h_inf);
    return h;
  }
  /// The half-space that an obstacle leaves to each sample; false where one lies in an obstacle.
  bool look_around() {
    bounds_.resize(lasting_);
    return all_samples(q_, [&](std::size_t n, Eigen::Index first, const std::array<double, 4>& w, double) {
      const Vec3 command = sum(q_, first, w), p = flown_.empty() ? command : command + flown_[n].off;
      const auto [d, gradient] = world_.distance.linear(p);
      const double norm = gradient.norm();
      if (d < taken_ / 2) return false;
      if (d > taken_ + kFar || !(norm > 0)) return true;
      const Vec3 along = gradient / norm;
      const double left = flown_.empty() ? d - taken_ - support(hover_set(p), along)
                                         : d - taken_ - support(flown_[n].h, along) + flown_[n].more;
      bounds_.push_back({first, w, along, along.dot(command) - left, INFINITY});
      return true;
    });
  }

  /// Adds penalty·(excess + n·Σ w_k dq_{first+k})², as a function of what the free control points move by: its Hessian
  /// and its slope, both halved.
  void add(Banded& H, std::vector<double>& g, const Bound& bound, double excess, double penalty) const {
    const Eigen::Index fixed = std::max<Eigen::Index>(0, 3 - bound.first);
    for (Eigen::Index k = fixed; k < 4 && bound.first + k - 3 < free(); ++k)
      for (Eigen::Index a = 0; a < 3; ++a) {
        const double row = penalty * bound.w[static_cast<std::size_t>(k)] * bound.n[a];
        if (row == 0) continue;
        const auto i = static_cast<std::size_t>(3 * (bound.first + k - 3) + a);
        g[i] += row * excess;
        for (Eigen::Index l = fixed; l <= k; ++l)
          for (Eigen::Index b = 0; b < (k == l ? a + 1 : 3); ++b)
            H(i, static_cast<std::size_t>(3 * (bound.first + l - 3) + b)) +=
                row * bound.w[static_cast<std::size_t>(l)] * bound.n[b];
      }
  }

  /// To the least of the squares under the bounds as they are: Newton's steps, each as long as it gains.
  void minimise() {
    Points by = Points::Zero(3, q_.cols());
    for (int step = 0; step < kSteps; ++step, ++steps_) {
      Banded H = jerk_;
      std::vector<double> g(jerk_.size());
      for (Eigen::Index first = 0; first + 3 < q_.cols(); ++first) {
        const Vec3 third = sum(q_, first, kThird);
        for (Eigen::Index k = std::max<Eigen::Index>(0, 3 - first); k < 4 && first + k - 3 < free(); ++k)
          Eigen::Map<Vec3>(&g[static_cast<std::size_t>(3 * (first + k - 3))]) +=
              kThird[static_cast<std::size_t>(k)] * third;
      }
      for (Bound& bound : bounds_) {
        bound.value = bound.n.dot(sum(q_, bound.first, bound.w));
        if (const double excess = bound.excess(0); excess != 0) add(H, g, bound, excess, kPenalty);
      }
      H.solve(g);
      by.middleCols(3, free()) = -Eigen::Map<const Points>(g.data(), 3, free());
      const double share = longest(by);
      q_ += share * by;
      if (share * by.cwiseAbs().maxCoeff() < kSettledStep) return;
    }
  }
  /// The share of a step that gains most: where the slope of the cost along it, which grows, is zero.
  double longest(const Points& by) {
    double slope_now = 0, growth = 0;
    for (Eigen::Index first = 0; first + 3 < q_.cols(); ++first) {
      const Vec3 change = sum(by, first, kThird);
      slope_now += sum(q_, first, kThird).dot(change);
      growth += change.squaredNorm();
    }
    for (Bound& bound : bounds_) bound.slope = bound.n.dot(sum(by, bound.first, bound.w));
    double low = 0, high = 1, share = 1;
    for (int halving = 0; halving <= kHalvings; ++halving, share = (low + high) / 2) {
      double slope = slope_now + share * growth;
      for (const Bound& bound : bounds_) slope += kPenalty * bound.excess(share) * bound.slope;
      if (share == 1 && slope <= 0) return 1;
      (slope > 0 ? high : low) = share;
    }
    return share;
  }

  const World& world_;
  bool norm_;
  double taken_;
  Points q_;
  Banded jerk_;
  std::vector<Bound> bounds_;  // those of the limits first
  std::size_t lasting_ = 0;    // bounds that stay
  std::size_t steps_ = 0;
  std::vector<Sample> flown_;  // empty: none
};

}  // namespace

LeastJerk least_jerk(const World& world, const BSpline& curve, const Flown* flown, double margin,
                     const MotionLimits& limits, bool norm) {
  return Newton(world, curve, flown, margin, limits, norm).run(curve);
}

}  // namespace backwash::plan

// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/spline/spline_cost.hpp"

#include <algorithm>
#include <cmath>

#include "core/map/lattice.hpp"
#include "core/reach/clearance.hpp"

namespace backwash::plan {

namespace {

constexpr double kExact = 0.3;           ///< m: nearer than this the tube's clearance is measured with its prism
constexpr double kNear = 0.12;           ///< m: farther than this beyond the margin a sample costs nothing
constexpr double kForgottenShare = 0.1;  ///< share of the hover set whose oldest causes are left out of Δe
constexpr std::size_t kSettling = 20;    ///< periods of the hold that count
constexpr std::size_t kLongestStride = 5;

/// Periods between samples: a voxel of flight at full speed.
std::size_t stride(double resolution, double v_max) {
  const double periods = std::round(1.2 * resolution / (v_max * kControlPeriod));
  return static_cast<std::size_t>(std::clamp(periods, 1.0, static_cast<double>(kLongestStride)));
}

/// G_j of docs/model.md section 5.2 summed over intervals of `stride` steps, until what is left is forgotten.
std::vector<double> coarse(const reach::AxisResponse& response, std::size_t stride) {
  std::vector<double> sums;
  double covered = 0;
  for (std::size_t j = 0; j < response.G.size() && covered < (1 - kForgottenShare) * response.h_inf; j += stride) {
    double sum = 0;
    for (std::size_t n = j; n < std::min(j + stride, response.G.size()); ++n) sum += response.G[n];
    sums.push_back(sum);
    covered += sum;
  }
  return sums;
}

/// The support of the octagonal prism along a unit direction as a combination Σ k_d h_d of the two horizontal faces
/// next to it and z.
PerDirection support_weights(const Vec3& n) {
  PerDirection k{};
  const double x = std::abs(n.x()), y = std::abs(n.y());
  k[x >= y ? kX : kY] = std::abs(x - y);
  k[n.x() * n.y() >= 0 ? kXyPlus : kXyMinus] = std::sqrt(2.0) * std::min(x, y);
  k[kZ] = std::abs(n.z());
  return k;
}

/// ‖h‖₂ of the half-widths along x, y, z as a combination Σ k_d h_d: its weights are its derivatives too.
PerDirection norm_weights(const Vec3& h) {
  PerDirection k{};
  const double norm = h.norm();
  if (norm > 0) {
    k[kX] = h.x() / norm;
    k[kY] = h.y() / norm;
    k[kZ] = h.z() / norm;
  }
  return k;
}

double combined(const PerDirection& k, const PerDirection& h) {
  double sum = 0;
  for (std::size_t d = 0; d < kDirections; ++d) sum += k[d] * h[d];
  return sum;
}

using Points = SplineCost::Points;

/// What each sample's predicted position moves by when the free control points move.
Points displaced(const MotionBasis& basis, const Points& moved) {
  Points p(basis.P_horizontal.rows(), 3);
  p.leftCols<2>().noalias() = basis.P_horizontal * moved.leftCols<2>();
  p.col(2).noalias() = basis.P_vertical * moved.col(2);
  return p;
}

/// And what the velocity of the sample in this row changes by.
Vec3 faster(const MotionBasis& basis, const Points& moved, Eigen::Index row) {
  Vec3 v;
  v.head<2>() = (basis.V_horizontal.row(row) * moved.leftCols<2>()).transpose();
  v.z() = basis.V_vertical.row(row).dot(moved.col(2));
  return v;
}

/// The chain rule: slopes by the samples' positions and velocities become slopes by the free control points.
void add_by_points(const MotionBasis& basis, const Points& by_p, const Points& by_v, Points& gradient) {
  gradient.leftCols<2>() += basis.P_horizontal.transpose() * by_p.leftCols<2>();
  gradient.leftCols<2>() += basis.V_horizontal.transpose() * by_v.leftCols<2>();
  gradient.col(2) += basis.P_vertical.transpose() * by_p.col(2);
  gradient.col(2) += basis.V_vertical.transpose() * by_v.col(2);
}

/// Slopes of k·Δe of sample m in direction d, by the positions of the samples before it.
void add_growth_slope(double k, std::size_t d, const std::vector<double>& G, const std::vector<LocalBound>& local,
                      std::size_t m, Points& by_p) {
  for (std::size_t age = 0; age < std::min(G.size(), m); ++age)
    by_p.row(static_cast<Eigen::Index>(m - 1 - age)) +=
        k * G[age] * local[m - 1 - age].gradient.col(static_cast<Eigen::Index>(d)).transpose();
}

}  // namespace

LocalBound interpolated(const map::OccupancyGrid& grid, const reach::BoundField& bounds, const Vec3& p_W) noexcept {
  const Vec3 q = (p_W - grid.origin()) / grid.resolution() - Vec3::Constant(0.5);
  LocalBound sum;
  double weight = 0;
  Vec3 slope = Vec3::Zero();  // of the weight, per voxel
  map::for_corners(q, [&](const Index3& v, const Vec3& share) {
    const DisturbanceBound b = bounds.at(v);
    if (!(b.w[kZ] > 0)) return;  // not stored
    const Vec3 sign = (q - v.cast<double>()).unaryExpr([](double x) { return x < 0 ? 1.0 : -1.0; });
    const double s = share.prod();
    const Vec3 ds(sign.x() * share.y() * share.z(), share.x() * sign.y() * share.z(), share.x() * share.y() * sign.z());
    weight += s;
    slope += ds;
    for (std::size_t d = 0; d < kDirections; ++d) {
      sum.w[d] += s * b.w[d];
      sum.gradient.col(static_cast<Eigen::Index>(d)) += ds * b.w[d];
    }
  });
  if (!(weight > 0)) return {};
  for (std::size_t d = 0; d < kDirections; ++d) {
    sum.w[d] /= weight;
    auto gradient = sum.gradient.col(static_cast<Eigen::Index>(d));
    gradient = (gradient - sum.w[d] * slope).eval() / (weight * grid.resolution());
  }
  return sum;
}

SplineCost::SplineCost(const World& world, const BSpline& spline, const reach::ReachTube& tube, double margin,
                       const MotionLimits& limits, const CostWeights& weights, bool norm)
    : world_(world),
      initial_(spline),
      v_limits_(spline.control_points.size() - 1, 3),
      a_limit_(limits.a),
      weights_(weights),
      norm_(norm),
      stride_(stride(world.grid.resolution(), limits.v.maxCoeff())) {
  for (Eigen::Index i = 0; i < v_limits_.rows(); ++i)
    v_limits_.row(i) = limits.velocity(static_cast<std::size_t>(i), spline.knot_span).transpose();
  const auto commands = static_cast<std::size_t>(std::ceil(spline.duration() / kControlPeriod));
  const std::size_t last = std::min(commands + kSettling, tube.size() - 1);
  basis_ = world.response.basis(spline.control_points.size(), spline.knot_span, last / stride_, stride_);
  for (std::size_t k = stride_; k <= last; k += stride_) samples_.push_back(sample(tube, k, margin));
  if (world.constant_margin) return;
  G_horizontal_ = coarse(world.reach.horizontal, stride_);
  G_vertical_ = coarse(world.reach.vertical, stride_);
}

SplineCost::Sample SplineCost::sample(const reach::ReachTube& tube, std::size_t k, double margin) const {
  const auto& vehicle = world_.reach.vehicle;
  const std::optional<double> ball = world_.constant_margin;
  const double taken = reach::body_and_estimation(vehicle) + ball.value_or(0.0);
  const reach::TubeStep& step = tube[k];
  const PerDirection h = ball ? PerDirection{} : step.half_widths_interval;
  Sample s{step.center.p_W, step.center.v_W, 0, world_.distance.interpolated(step.center.p_W), {}, {}};
  const Vec3 gradient = world_.distance.gradient(s.p), box(h[kX], h[kY], h[kZ]);
  s.k = norm_ ? norm_weights(box) : support_weights(gradient.norm() > 0 ? gradient.normalized() : box.normalized());
  s.clearance = s.distance - combined(s.k, h) - taken;
  if (!norm_ && s.clearance < kExact) {
    const State& next = tube[std::min(k + 1, tube.size() - 1)].center;
    const double distance = reach::swept_prism_distance(world_.grid, s.p, next.p_W, h, taken + kExact);
    // A set that meets an obstacle does so by an unknown depth: the support says more then.
    if (distance > 0) s.clearance = distance - taken;
  }
  s.clearance -= margin;
  if (!ball) s.w = interpolated(world_.grid, world_.bounds, s.p).w;
  return s;
}

SplineCost::Points SplineCost::start_point() const {
  Points points(static_cast<Eigen::Index>(initial_.control_points.size()) - 6, 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    points.row(i) = initial_.control_points[static_cast<std::size_t>(i) + 3].transpose();
  return points;
}

BSpline SplineCost::spline_at(const Points& points) const {
  BSpline spline = initial_;
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    spline.control_points[static_cast<std::size_t>(i) + 3] = points.row(i).transpose();
  return spline;
}

SplineCost::Value SplineCost::operator()(const Points& points) const {
  const Eigen::Index n = points.rows();
  const auto& fixed = initial_.control_points;
  Points q(n + 6, 3), gradient = Points::Zero(n + 6, 3);
  for (Eigen::Index i = 0; i < 3; ++i) {
    q.row(i) = fixed[static_cast<std::size_t>(i)].transpose();
    q.row(n + 3 + i) = fixed[fixed.size() - 3 + static_cast<std::size_t>(i)].transpose();
  }
  q.middleRows(3, n) = points;
  Value value{smoothness(q, gradient) + limits(q, gradient), {}};
  value.gradient = gradient.middleRows(3, n);
  value.f += collision(points - start_point(), value.gradient);
  return value;
}

double SplineCost::smoothness(const Points& q, Points& gradient) const {
  const Eigen::Index n = q.rows() - 3;
  const Points third = q.bottomRows(n) - q.topRows(n) + 3 * (q.middleRows(1, n) - q.middleRows(2, n));
  const double scale = 2 * weights_.smooth;
  gradient.topRows(n) -= scale * third;
  gradient.middleRows(1, n) += 3 * scale * third;
  gradient.middleRows(2, n) -= 3 * scale * third;
  gradient.bottomRows(n) += scale * third;
  return weights_.smooth * third.squaredNorm();
}

double SplineCost::limits(const Points& q, Points& gradient) const {
  const Eigen::Index n = q.rows();
  const double d = 1 / initial_.knot_span;
  const Points v = d * (q.bottomRows(n - 1) - q.topRows(n - 1));
  const Points a = d * (v.bottomRows(n - 2) - v.topRows(n - 2));
  // (x² − limit²)² of each axis beyond its limit.
  const Eigen::ArrayX3d v_excess = (v.array().square() - v_limits_.array().square()).max(0.0);
  const Eigen::ArrayX3d a_excess = (a.array().square().rowwise() - a_limit_.transpose().array().square()).max(0.0);
  const double f = v_excess.square().sum() + a_excess.square().sum();
  if (f == 0) return 0;
  const Points v_slope = 4 * weights_.physical * d * (v_excess * v.array()).matrix();
  const Points a_slope = 4 * weights_.physical * d * d * (a_excess * a.array()).matrix();
  gradient.bottomRows(n - 1) += v_slope;
  gradient.topRows(n - 1) -= v_slope;
  gradient.topRows(n - 2) += a_slope;
  gradient.middleRows(1, n - 2) -= 2 * a_slope;
  gradient.bottomRows(n - 2) += a_slope;
  return weights_.physical * f;
}

// What the sets grow by at the near samples, and the field along the motion as far as they need it.
void SplineCost::grow(const std::vector<Vec3>& p, const std::vector<std::size_t>& near, std::vector<double>& lack,
                      std::vector<LocalBound>& local) const {
  if (G_horizontal_.empty()) return;
  const std::size_t longest = std::max(G_horizontal_.size(), G_vertical_.size());
  local.resize(near.back());
  std::size_t known = 0;  // below it, what a near sample needs is there
  for (const std::size_t m : near)
    for (known = std::max(known, m > longest ? m - longest : 0); known < m; ++known)
      local[known] = interpolated(world_.grid, world_.bounds, p[known]);
  for (std::size_t n = 0; n < near.size(); ++n)
    for (std::size_t d = 0; d < kDirections; ++d) {
      const double k = samples_[near[n]].k[d];
      const auto& G = d == kZ ? G_vertical_ : G_horizontal_;
      if (k == 0) continue;
      for (std::size_t age = 0; age < std::min(G.size(), near[n]); ++age) {
        const std::size_t j = near[n] - 1 - age;
        lack[n] += k * G[age] * (local[j].w[d] - samples_[j].w[d]);
      }
    }
}

double SplineCost::collision(const Points& moved, Points& gradient) const {
  const std::size_t count = samples_.size();
  Points p = displaced(basis_, moved);
  std::vector<Vec3> at(count);
  std::vector<std::size_t> near;
  std::vector<double> lack;
  for (std::size_t m = 0; m < count; ++m) {
    const Sample& s = samples_[m];
    at[m] = s.p + p.row(static_cast<Eigen::Index>(m)).transpose();
    // Each slope of the interpolated distance is at most 1: what cannot have come near is not looked up.
    if (s.clearance - std::sqrt(3.0) * p.row(static_cast<Eigen::Index>(m)).norm() > kNear) continue;
    const double left = s.clearance - s.distance + world_.distance.interpolated(at[m]);
    if (left > kNear) continue;
    near.push_back(m);
    lack.push_back(-left);
  }
  if (near.empty()) return 0;
  std::vector<LocalBound> local;
  grow(at, near, lack, local);

  double f = 0;
  const double scale = weights_.collision * static_cast<double>(stride_) * kControlPeriod;
  p.setZero();  // from here on: ∂f/∂position
  Points v = Points::Zero(p.rows(), 3);
  for (std::size_t n = 0; n < near.size(); ++n) {
    if (lack[n] <= 0) continue;
    const std::size_t m = near[n];
    const auto row = static_cast<Eigen::Index>(m);
    const Vec3 velocity = samples_[m].v + faster(basis_, moved, row);
    const double speed = velocity.norm(), by_lack = 2 * scale * lack[n] * speed;
    f += scale * lack[n] * lack[n] * speed;
    if (speed > 0) v.row(row) = scale * lack[n] * lack[n] / speed * velocity.transpose();
    p.row(row) -= by_lack * world_.distance.gradient(at[m]).transpose();
    for (std::size_t d = 0; d < kDirections && !local.empty(); ++d)
      if (const double k = by_lack * samples_[m].k[d]; k != 0)
        add_growth_slope(k, d, d == kZ ? G_vertical_ : G_horizontal_, local, m, p);
  }
  if (f == 0) return 0;
  add_by_points(basis_, p, v, gradient);
  return f;
}

}  // namespace backwash::plan

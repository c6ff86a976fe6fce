// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/risk.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <vector>

#include "core/reach/clearance.hpp"
#include "core/reach/response/coloured_error.hpp"
#include "core/types/normal.hpp"

namespace backwash::reach {
namespace {

constexpr double kFarthest = 6;  ///< standard deviations: each half space that is farther adds less than 1e-8 a second

/// Half of space beyond which an obstacle lies: e must come to n·e = u to touch.
struct HalfSpace {
  Vec3 n, at_W;
  double u = 0, sigma = 0;
  double level() const noexcept { return u > 0 ? u / sigma : 0.0; }
  double outside() const noexcept { return sigma > 0 ? normal::below(-u / sigma) : u > 0 ? 0.0 : 1.0; }
};

/// Error of one entry of a tube.
struct Spread {
  Mat3 covariance;              ///< m²
  double turn_rate;             ///< rad/s, the largest of all directions
  double horizontal, vertical;  ///< what mean push and first set may add, m
  double along(const Vec3& n) const noexcept { return std::sqrt(std::max(0.0, n.dot(covariance * n))); }
  double steady(const Vec3& n) const noexcept { return horizontal * n.head<2>().norm() + vertical * std::abs(n.z()); }
  double largest() const noexcept {  // at least the largest deviation
    return std::sqrt(std::max(covariance(0, 0) + covariance(1, 1), covariance(2, 2)));
  }
};

/// The error's covariance along a tube (5.3-2), one entry after the other.
class ErrorAlongTube {
 public:
  ErrorAlongTube(const Reachability& reach, const BoundModel& model)
      : reach_(reach),
        model_(model),
        horizontal_(axis_loop(reach.vehicle, false, reach.loop), model.tau_w, kControlPeriod),
        vertical_(axis_loop(reach.vehicle, true, reach.loop), model.tau_w, kControlPeriod),
        error_{ErrorCovariance(horizontal_), ErrorCovariance(horizontal_), ErrorCovariance(vertical_),
               ErrorCovariance(horizontal_), ErrorCovariance(horizontal_)} {}

  Spread now() const {
    std::array<double, kDirections> variance;
    double turn_rate = 0;
    for (std::size_t d = 0; d < kDirections; ++d) {
      variance[d] = std::pow(error_[d].position_deviation(), 2);
      turn_rate = std::max(turn_rate, error_[d].turn_rate());
    }
    Mat3 C = Mat3::Zero();
    C.diagonal() << variance[kX], variance[kY], variance[kZ];
    C(0, 1) = C(1, 0) = (variance[kXyPlus] - variance[kXyMinus]) / 2;
    // The bounds of a step may be those of several places: no direction has less than its own.
    const double more = (variance[kXyPlus] + variance[kXyMinus] - variance[kX] - variance[kY]) / 2;
    C(0, 0) += std::max(0.0, more);
    C(1, 1) += std::max(0.0, more);
    return {C, turn_rate, steady(reach_.horizontal, model_.mean_horizontal),
            steady(reach_.vertical, model_.mean_vertical)};
  }
  void step(const DisturbanceBound& w_bar) {
    for (std::size_t d = 0; d < kDirections; ++d) {
      const double mean = d == kZ ? model_.mean_vertical : model_.mean_horizontal;
      error_[d].advance(std::max(0.0, w_bar.w[d] - mean) / model_.kappa);
    }
    ++steps_;
  }

 private:
  double steady(const AxisResponse& axis, double mean) const {
    const std::size_t at = steps_ * AxisResponse::kPhases;
    const auto left = [at](const std::vector<double>& r, double tail) { return at < r.size() ? r[at] : tail; };
    const auto& first = reach_.vehicle.initial_error;
    return axis.h_inf * mean + std::hypot(first.position * left(axis.from_position, axis.from_position_tail),
                                          first.velocity * left(axis.from_velocity, axis.from_velocity_tail));
  }
  const Reachability& reach_;
  const BoundModel& model_;
  ColouredStep horizontal_, vertical_;
  std::array<ErrorCovariance, kDirections> error_;
  std::size_t steps_ = 0;
};

/// An entry of a tube: the centre moves from one point to the next, and what may be off it.
struct Moment {
  Vec3 middle_W, half;  ///< of the motion, m
  Spread spread;
  /// Beyond what lies at `at_W` in direction n.
  HalfSpace beyond(const Vec3& n, const Vec3& at_W, double taken) const noexcept {
    return {n, at_W, n.dot(at_W - middle_W) - taken - spread.steady(n) - std::abs(n.dot(half)), spread.along(n)};
  }
};

/// The obstacles around a motion as half spaces that hold them all: the one with the least level, then that of what
/// does not lie beyond it, and so on. A flat wall is one, however many voxels it has.
class Surroundings {
 public:
  Surroundings(const map::OccupancyGrid& grid, double taken) : grid_(grid), taken_(taken) {}

  const std::vector<HalfSpace>& around(const Moment& now) {
    found_.clear();
    voxels_.clear();
    const auto& spread = now.spread;
    const double a = grid_.resolution(),
                 far = kFarthest * spread.largest() + spread.horizontal + spread.vertical + taken_;
    const Vec3 extent = now.half.cwiseAbs() + Vec3::Constant(far);
    gather(now.middle_W - extent, now.middle_W + extent);
    for (const Vec3& center_W : gathered_)
      if (const Vec3 r = center_W - now.middle_W; (r.array().abs() <= extent.array() + a / 2).all())
        voxels_.push_back(r);
    while (!voxels_.empty()) {
      HalfSpace nearest;
      double least = std::numeric_limits<double>::infinity(), offset = 0;
      for (const Vec3& r : voxels_) {
        const Vec3 q = (r.array().sign() * (r.array().abs() - a / 2).max(0)).matrix();  // its nearest point
        const double distance = q.norm();
        const Vec3 n = distance > 0 ? (q / distance).eval() : Vec3::UnitX().eval();
        const HalfSpace h = now.beyond(n, now.middle_W + q, taken_);
        // Not by what the motion takes off: an edge ahead would come before the wall that holds it.
        const double level = HalfSpace{n, h.at_W, h.u + std::abs(n.dot(now.half)), h.sigma}.level();
        if (level < least || (level == least && distance < offset)) {
          least = level;
          nearest = h;
          offset = distance;
        }
      }
      if (!(least <= kFarthest)) break;
      found_.push_back(nearest);
      std::erase_if(voxels_, [&](const Vec3& r) {
        return nearest.n.dot(r) - a / 2 * nearest.n.lpNorm<1>() >= offset - 1e-9 * a || offset == 0;
      });
    }
    return found_;
  }

 private:
  /// Those of a box at least: a flight's next boxes lie within what was gathered for this one.
  void gather(const Vec3& low_W, const Vec3& high_W) {
    constexpr double kAhead = 0.3;  // m
    if ((low_W.array() >= low_W_.array()).all() && (high_W.array() <= high_W_.array()).all()) return;
    gathered_.clear();
    low_W_ = low_W - Vec3::Constant(kAhead);
    high_W_ = high_W + Vec3::Constant(kAhead);
    const Index3 low = grid_.index(low_W_), high = grid_.index(high_W_);
    for (int k = low.z(); k <= high.z(); ++k)
      for (int j = low.y(); j <= high.y(); ++j)
        for (int i = low.x(); i <= high.x(); ++i)
          if (const Index3 v(i, j, k); met_first(v)) gathered_.push_back(grid_.center(v));
  }
  /// An obstacle that something free lies beside: the others are not touched before these.
  bool met_first(const Index3& v) const noexcept {
    if (grid_.free(v)) return false;
    for (int axis = 0; axis < 3; ++axis)
      if (grid_.free(v + Index3::Unit(axis)) || grid_.free(v - Index3::Unit(axis))) return true;
    return false;
  }
  const map::OccupancyGrid& grid_;
  double taken_;
  Vec3 low_W_ = Vec3::Zero(), high_W_ = Vec3::Constant(-1);  // of the box that was gathered
  std::vector<Vec3> gathered_;                               // centres
  std::vector<Vec3> voxels_;                                 // those about the motion, from its middle
  std::vector<HalfSpace> found_;
};

/// Angle between the errors towards a half space and towards the nearest of those before, rad; 0 where there is none.
double turn(const HalfSpace& h, const std::vector<HalfSpace>& earlier, const Spread& spread) {
  double cosine = earlier.empty() ? 1 : -1;
  for (const HalfSpace& e : earlier) {
    const double product = h.sigma * spread.along(e.n);
    cosine = std::max(cosine, product > 0 ? h.n.dot(spread.covariance * e.n) / product : 1.0);
  }
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

bool finite(const TubeStep& step) {
  return step.center.p_W.allFinite() && std::ranges::all_of(step.w_bar.w, [](double w) { return std::isfinite(w); });
}

/// Where most of the risk comes from: the worst entry of the worst second.
void tell_worst(const ReachTube& tube, const std::vector<double>& spent, const std::vector<HalfSpace>& worst,
                Risk& risk) {
  const std::size_t second = std::min<std::size_t>(tube.size(), 50);
  double sum = 0;
  for (std::size_t k = 0; k < tube.size(); ++k) {
    sum += spent[k] - (k >= second ? spent[k - second] : 0);
    if (sum <= risk.largest) continue;
    const std::size_t first = k + 1 - std::min(k + 1, second);
    const auto at = std::max_element(spent.begin() + static_cast<std::ptrdiff_t>(first),
                                     spent.begin() + static_cast<std::ptrdiff_t>(k) + 1) -
                    spent.begin();
    risk = {risk.total,     sum,         tube[at].t,      tube[at].center.p_W,
            worst[at].at_W, worst[at].u, worst[at].sigma, risk.a_minute};
  }
}

}  // namespace

double kappa_of(const Reachability& reach, double tau_w, double risk, double seconds) {
  if (!(risk > 0) || !(risk < 1)) throw std::invalid_argument("a risk lies above 0 and below 1");
  double kappa = 0;
  for (const bool vertical : {false, true}) {
    const ColouredStep step(axis_loop(reach.vehicle, vertical, reach.loop), tau_w, kControlPeriod);
    ErrorCovariance error(step);
    for (double before = -1; error.position_deviation() > before * (1 + 1e-9);) {
      before = error.position_deviation();
      for (int second = 0; second < 50; ++second) error.advance(1);
    }
    const double level = exit_level(seconds * error.turn_rate() / 2, std::numeric_limits<double>::infinity(), risk);
    kappa = std::max(kappa, level * error.position_deviation() / (vertical ? reach.vertical : reach.horizontal).h_inf);
  }
  return kappa;
}

Risk risk_of_touching(const Reachability& reach, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                      const BoundModel& model, const ReachTube& tube, double enough, std::size_t from, double apart) {
  if (!(model.kappa > 0)) throw std::invalid_argument("a risk needs kappa above 0");
  if (has_integrator(reach.vehicle) || reach.loop == Loop::sampled)
    throw std::invalid_argument("a risk is known for loops without an integrator and with continuous feedback");
  const double taken = body_and_estimation(reach.vehicle) + apart, slack = grid.resolution() * std::sqrt(3.0);
  ErrorAlongTube error(reach, model);
  Surroundings surroundings(grid, taken);
  Risk risk;
  if (!std::ranges::all_of(tube, finite)) return {std::numeric_limits<double>::infinity()};
  std::vector<double> spent(tube.size());
  std::vector<HalfSpace> worst(tube.size());
  std::optional<Moment> before;
  std::vector<HalfSpace> earlier;  // those of the entry before
  for (std::size_t k = 0; k < std::min(from, tube.size()); ++k) error.step(tube[k].w_bar);
  double turning = 0;  // of an entry
  for (std::size_t k = from; k < tube.size() && risk.total <= enough; ++k) {
    const Vec3 &here = tube[k].center.p_W, &next = tube[std::min(k + 1, tube.size() - 1)].center.p_W;
    const Moment now{(here + next) / 2, (next - here) / 2, error.now()};
    const Spread& spread = now.spread;
    const double left =
        distance.interpolated(here) - slack - (next - here).norm() - taken - spread.horizontal - spread.vertical;
    std::vector<HalfSpace> found;
    turning = 0;
    if (!(left >= kFarthest * spread.largest())) found = surroundings.around(now);
    double least = std::numeric_limits<double>::infinity();
    for (const HalfSpace& h : found) {
      const double level = h.level(), was = before ? before->beyond(h.n, h.at_W, taken).outside() : 0;
      // The error turns by itself, and towards the obstacle as the vehicle goes round it.
      const double turned = std::hypot(kControlPeriod * spread.turn_rate, turn(h, earlier, spread));
      turning += turned / (2 * std::numbers::pi) * std::exp(-level * level / 2);
      spent[k] += std::max(0.0, h.outside() - was);
      if (level < least) {
        least = level;
        worst[k] = h;
      }
    }
    earlier = std::move(found);
    before = now;
    risk.total += spent[k] += turning;
    error.step(tube[k].w_bar);
  }
  if (risk.total <= enough) risk.a_minute = 60 / kControlPeriod * turning;
  tell_worst(tube, spent, worst, risk);
  return risk;
}

}  // namespace backwash::reach

// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/rest.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::reach {
namespace {

constexpr double kForgotten = 0.02;  ///< share of the hover set

std::size_t settling_periods(const AxisResponse& axis) {
  double left = axis.tail;
  std::size_t n = axis.G.size();
  while (n > 0 && left + axis.G[n - 1] <= kForgotten * axis.h_inf) left += axis.G[--n];
  return n;
}

/// Largest of |r| from an entry on, its tail included.
double largest(const std::vector<double>& r, std::size_t from, double tail) {
  for (std::size_t m = std::min(from, r.size()); m < r.size(); ++m) tail = std::max(tail, std::abs(r[m]));
  return tail;
}

/// Entry n: largest share of a step that is n steps old or more (5.2-7).
std::vector<double> shares(const AxisResponse& axis) {
  std::vector<double> share(axis.G.size());
  double most = 0, excess = axis.chord_excess;
  for (std::size_t n = share.size(); n-- > 0;) share[n] = most = std::max(most, axis.G[n]);
  for (double& s : share) {
    s += excess;
    excess *= axis.chord_decay;
  }
  return share;
}

}  // namespace

std::size_t settling_periods(const Reachability& reach) {
  return std::max(settling_periods(reach.horizontal), settling_periods(reach.vertical));
}

WidthsAtRest::WidthsAtRest(const Reachability& reach, const ReachTube& arrival, const Vec3& c_W,
                           const BoundModel& model)
    : horizontal_{reach.horizontal.h_inf, reach.horizontal.tail, shares(reach.horizontal)},
      vertical_{reach.vertical.h_inf, reach.vertical.tail, shares(reach.vertical)},
      times_(model.at_rest()) {
  const std::size_t steps = arrival.size() - 1,
                    known = std::min(steps, std::max(horizontal_.share.size(), vertical_.share.size()));
  for (std::size_t n = 1; n <= steps; ++n) {
    const DisturbanceBound& w = arrival[steps - n].w_bar;
    if (n <= known) w_.push_back(w);
    for (std::size_t d = 0; n > known && d < kDirections; ++d) older_.w[d] = std::max(older_.w[d], w.w[d]);
  }
  const auto& first = reach.vehicle.initial_error;
  const Vec3 off = arrival.back().center.p_W - c_W, &v = arrival.back().center.v_W;
  for (std::size_t d = 0; d < kDirections; ++d) {
    const AxisResponse& axis = d == kZ ? reach.vertical : reach.horizontal;
    const auto after = [&](std::size_t from) {
      return Eigen::Array2d(largest(axis.from_position, from, axis.from_position_tail),
                            largest(axis.from_velocity, from, axis.from_velocity_tail));
    };
    const Vec3 n = unit(static_cast<Direction>(d));
    const Eigen::Array2d now = after(0), left = after(AxisResponse::kPhases * steps);
    left_[d] = std::hypot(first.position * left[0], first.velocity * left[1]) + std::abs(n.dot(off)) * now[0] +
               std::abs(n.dot(v)) * now[1];
  }
}

PerDirection WidthsAtRest::operator()(const DisturbanceBound& w_bar) const noexcept {
  PerDirection h;
  for (std::size_t d = 0; d < kDirections; ++d) {
    const Axis& axis = d == kZ ? vertical_ : horizontal_;
    const double here = w_bar.w[d];
    double oldest = older_.w[d];
    h[d] = left_[d] + axis.h_inf * here;
    for (std::size_t n = 0; n < w_.size(); ++n) {
      if (n < axis.share.size())
        h[d] += axis.share[n] * std::max(0.0, w_[n].w[d] - here);
      else
        oldest = std::max(oldest, w_[n].w[d]);
    }
    h[d] += axis.tail * std::max(0.0, oldest - here);
    h[d] *= times_;
  }
  return h;
}

}  // namespace backwash::reach

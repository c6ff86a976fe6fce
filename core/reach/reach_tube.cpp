// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/reach_tube.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace backwash::reach {
namespace {

// The paper's ellipsoid seen as half widths; the same operations as SupportRecursion.
class EllipsoidHalfWidths {
 public:
  explicit EllipsoidHalfWidths(const Reachability& reach) : reach_(&reach), recursion_(reach.vehicle) {}

  void step(const DisturbanceBound& w_bar) noexcept {
    recursion_.step(channels(w_bar));
    largest_ = largest_.cwiseMax(channels(w_bar));
  }
  PerDirection half_widths() const noexcept { return widths(recursion_.position_shape()); }
  // The larger of both ends; in between a motion leaves its chord by at most dt²/8·|ë|.
  PerDirection half_widths_until_next(const DisturbanceBound& next) const noexcept {
    EllipsoidRecursion after = recursion_;
    after.step(channels(next));
    PerDirection h = half_widths();
    const PerDirection end = widths(after.position_shape());
    const Vec3 w = largest_.cwiseMax(channels(next));
    const auto& initial = reach_->vehicle.initial_error;
    for (std::size_t d = 0; d < kDirections; ++d) {
      const AxisResponse& axis = d == kZ ? reach_->vertical : reach_->horizontal;
      const double along = unit(static_cast<Direction>(d)).cwiseAbs().dot(w);  // the channels' box
      const double acceleration = axis.acceleration_inf * along + axis.acceleration_from_position * initial.position +
                                  axis.acceleration_from_velocity * initial.velocity;
      h[d] = std::max(h[d], end[d]) + kControlPeriod * kControlPeriod / 8 * acceleration;
    }
    return h;
  }
  Mat3 shape() const noexcept { return recursion_.position_shape(); }

 private:
  static Vec3 channels(const DisturbanceBound& b) noexcept { return {b.w[kX], b.w[kY], b.w[kZ]}; }
  static PerDirection widths(const Mat3& Q_pp) noexcept {
    PerDirection h;
    for (std::size_t d = 0; d < kDirections; ++d) {
      const Vec3 n = unit(static_cast<Direction>(d));
      h[d] = std::sqrt(n.dot(Q_pp * n));
    }
    return h;
  }

  const Reachability* reach_;
  EllipsoidRecursion recursion_;
  Vec3 largest_ = Vec3::Zero();
};

struct ExactHalfWidths : SupportRecursion {
  explicit ExactHalfWidths(const Reachability& reach)
      : SupportRecursion(reach.horizontal, reach.vertical, reach.vehicle) {}
  Mat3 shape() const noexcept { return Mat3::Zero(); }
};

double largest_half_axis(const Mat3& shape, const PerDirection& h, Method method) {
  // The shape is diagonal: the axes never couple.
  return method == Method::paper ? std::sqrt(shape.diagonal().maxCoeff()) : Vec3(h[kX], h[kY], h[kZ]).norm();
}

// Centres at t = 0, 20 ms, …: one more than commands; push_at(k, state) is the mean push of step k.
template <typename PushAt>
std::vector<State> centres(const Reachability& reach, const State& start, const Setpoint& previous,
                           std::span<const Setpoint> commands, PushAt push_at) {
  const Vec3 a_W = commanded_acceleration(reach.vehicle, start, previous);
  CentrePredictor predictor(reach.vehicle, reach.loop, start, a_W, previous);
  std::vector<State> states{start};
  states.reserve(commands.size() + 1);
  for (std::size_t k = 0; k < commands.size(); ++k)
    states.push_back(predictor.step(commands[k], push_at(k, states.back())));
  return states;
}

// The bound of a step, and the half widths that it leads to until the next.
struct Bounded {
  DisturbanceBound w;
  PerDirection half_widths_interval;
};

// Runs the sets along the centres; bound_of(k, sets) is that of step k, given the sets at its start.
template <typename Sets, typename BoundOf>
ReachTube propagate(const Reachability& reach, const std::vector<State>& centers, BoundOf bound_of) {
  Sets sets(reach);
  ReachTube tube;
  tube.reserve(centers.size());
  Bounded step;
  for (std::size_t k = 0; k < centers.size(); ++k) {
    const bool last = k + 1 == centers.size();
    step = last ? Bounded{step.w, sets.half_widths_until_next(step.w)} : bound_of(k, sets);
    const PerDirection h = sets.half_widths();
    const Mat3 shape = sets.shape();
    tube.push_back({static_cast<double>(k) * kControlPeriod, centers[k], step.w, h, step.half_widths_interval, shape,
                    largest_half_axis(shape, h, reach.method)});
    if (!last) sets.step(step.w);
  }
  return tube;
}

DisturbanceBound larger(DisturbanceBound a, const DisturbanceBound& b) {
  for (std::size_t d = 0; d < kDirections; ++d) a.w[d] = std::max(a.w[d], b.w[d]);
  return a;
}

bool covers(const PerDirection& a, const PerDirection& b) {
  for (std::size_t d = 0; d < kDirections; ++d)
    if (b[d] > a[d]) return false;
  return true;
}

// BoundField::max_over of the boxes of one tube, most of which meet the voxels that the one before met.
class LastMaximum {
 public:
  explicit LastMaximum(const BoundField& bounds) : bounds_(bounds) {}
  const DisturbanceBound& over(const Vec3& low_W, const Vec3& high_W) noexcept {
    const map::VoxelBox box = bounds_.meeting(low_W, high_W);
    if (box.low != box_.low || box.high != box_.high) {
      box_ = box;
      w_ = bounds_.max_over_voxels(box.low, box.high);
    }
    return w_;
  }

 private:
  const BoundField& bounds_;
  map::VoxelBox box_{Index3::Ones(), Index3::Zero()};  // meets none: 0
  DisturbanceBound w_;
};

// A bound that is not below the field's maximum over the set it leads to itself, while the centre moves from one state
// to the next. The set grows by dt²/2 per unit of bound within a step, so one or two rounds settle it; the reach is
// doubled after that, which ends at the whole field at the latest.
template <typename Sets>
Bounded bound_over_set(const Sets& sets, const State& from, const State& to, const BoundField& bounds,
                       const NetDisturbance& net, LastMaximum& last) {
  const Vec3 low = from.p_W.cwiseMin(to.p_W), high = from.p_W.cwiseMax(to.p_W);
  const Vec3 push = bounds.push(from.p_W, from.v_W);
  const auto over = [&](const PerDirection& h) {
    const Vec3 reach(h[kX], h[kY], h[kZ]);
    if (net.held()) return net(bounds.max_without_push(from.v_W, low - reach, high + reach));
    if (bounds.extension().none()) return last.over(low - reach, high + reach);
    return bounds.max_about(push, from.v_W, low - reach, high + reach);
  };
  DisturbanceBound w = over(sets.half_widths());
  constexpr int kRounds = 4, kDoublings = 60;
  for (int round = 0; round < kRounds; ++round) {
    const PerDirection until_next = sets.half_widths_until_next(w);
    const DisturbanceBound found = over(until_next);
    if (covers(w.w, found.w)) return {w, until_next};
    w = larger(w, found);
  }
  PerDirection assumed = sets.half_widths_until_next(w);
  for (int doubling = 0; doubling < kDoublings; ++doubling) {
    for (double& h : assumed) h *= 2;
    w = larger(w, over(assumed));
    const PerDirection until_next = sets.half_widths_until_next(w);
    if (covers(assumed, until_next)) return {w, until_next};
  }
  return {w, sets.half_widths_until_next(w)};
}

}  // namespace

Reachability::Reachability(const Vehicle& v, Method m, Loop l)
    : vehicle(v),
      method(m),
      loop(l),
      horizontal(axis_response(axis_loop(v, false, m == Method::paper ? Loop::continuous : l),
                               m == Method::paper ? Loop::continuous : l)),
      vertical(axis_response(axis_loop(v, true, m == Method::paper ? Loop::continuous : l),
                             m == Method::paper ? Loop::continuous : l)),
      horizontal_integrator(integrator_response(axis_loop(v, false, l))),
      vertical_integrator(integrator_response(axis_loop(v, true, l))) {
  if (l == Loop::sampled && has_integrator(v))
    throw std::invalid_argument(
        "controller.velocity_integrator: --loop sampled does not know it; choose the loop vehicle or continuous");
}

ReachTube tube_with_bounds(const Reachability& reach, const State& start, const Setpoint& previous,
                           std::span<const Setpoint> commands, std::span<const DisturbanceBound> bounds,
                           std::span<const Vec3> pushes) {
  if (commands.size() != bounds.size() || (!pushes.empty() && pushes.size() != commands.size()))
    throw std::invalid_argument("tube_with_bounds: one bound per command is needed, and one push if any");
  const auto push_at = [pushes](std::size_t k, const State&) {
    return pushes.empty() ? Vec3::Zero().eval() : pushes[k];
  };
  const std::vector<State> centers = centres(reach, start, previous, commands, push_at);
  const auto given = [bounds](std::size_t k, const auto& sets) {
    return Bounded{bounds[k], sets.half_widths_until_next(bounds[k])};
  };
  return reach.method == Method::paper ? propagate<EllipsoidHalfWidths>(reach, centers, given)
                                       : propagate<ExactHalfWidths>(reach, centers, given);
}

ReachTube tube_over_field(const Reachability& reach, const State& start, const Setpoint& previous,
                          std::span<const Setpoint> commands, const BoundField& bounds) {
  const NetDisturbance net(reach, bounds);
  const auto push_at = [&](std::size_t, const State& s) {
    return net.held() ? Vec3::Zero().eval() : bounds.push(s.p_W, s.v_W);
  };
  const std::vector<State> centers = centres(reach, start, previous, commands, push_at);
  LastMaximum last(bounds);
  const auto from_field = [&](std::size_t k, const auto& sets) {
    return bound_over_set(sets, centers[k], centers[k + 1], bounds, net, last);
  };
  return reach.method == Method::paper ? propagate<EllipsoidHalfWidths>(reach, centers, from_field)
                                       : propagate<ExactHalfWidths>(reach, centers, from_field);
}

}  // namespace backwash::reach

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <stdexcept>

#include "core/reach/response/error_dynamics.hpp"

namespace backwash::reach {
namespace {

constexpr double kLongestSegment = 1e-3;  // s, where feedback is interpolated
constexpr double kSameInstant = 1e-9;     // s

// t in periods: whole ones and the remainder in seconds.
struct Periods {
  int whole;
  double rest;
};
Periods periods(double t) {
  const double whole = std::floor((t + kSameInstant) / kControlPeriod);
  const double rest = t - whole * kControlPeriod;
  return {static_cast<int>(whole), rest > kSameInstant ? rest : 0.0};
}

double in_range(double delay, const char* name) {
  if (!(delay >= 0) || delay > CentrePredictor::kMaxDelaySteps * kControlPeriod)
    throw std::invalid_argument(std::string("CentrePredictor: ") + name + " must lie in 0 … " +
                                std::to_string(CentrePredictor::kMaxDelaySteps * kControlPeriod) + " s");
  return delay;
}

}  // namespace

CentrePredictor::CentrePredictor(const Vehicle& vehicle, Loop loop, const State& start, const Vec3& a_W,
                                 const Setpoint& previous) {
  AxisLoop horizontal = axis_loop(vehicle, false, loop), vertical = axis_loop(vehicle, true, loop);
  double delay = in_range(horizontal.feedback_delay, "feedback_delay");
  if (delay > 0) delay = std::max(delay, kMinFeedbackDelay);
  horizontal.feedback_delay = vertical.feedback_delay = delay;
  kind_ = loop == Loop::sampled ? Feedback::held : delay > 0 ? Feedback::delayed : Feedback::immediate;
  lag_ = horizontal.attitude_lag > 0;
  kp_ = {horizontal.kp, horizontal.kp, vertical.kp};
  kd_ = {horizontal.kd, horizontal.kd, vertical.kd};

  const Periods latency = periods(in_range(vehicle.controller.latency, "latency"));
  command_delay_ = latency.whole;
  sample_delay_ = 0;
  add_subintervals(horizontal, vertical, latency.rest);
  begin(start, a_W, previous);
}

void CentrePredictor::begin(const State& start, const Vec3& a_W, const Setpoint& previous) noexcept {
  state_ = start;
  a_W_ = a_W;
  push_W_.setZero();
  x_.row(0) = start.p_W;
  x_.row(1) = start.v_W;
  x_.row(2) = a_W;
  r_.fill(kp_.cwiseProduct(previous.p_W) + kd_.cwiseProduct(previous.v_W) + previous.a_W);
  const Vec3 u = feedback(x_);
  held_.fill(u);
  std::ranges::fill(past_, FeedbackPiece{kControlPeriod, u, Vec3::Zero(), u, Vec3::Zero()});
}

namespace {

/// Where the pieces of a period begin, cut at some instants and nowhere longer than `longest`, s; its end comes last.
std::vector<double> pieces_of_period(std::initializer_list<double> cuts, double longest) {
  std::vector<double> knots{0, kControlPeriod};
  for (const double t : cuts)
    if (t > kSameInstant && t < kControlPeriod - kSameInstant) knots.push_back(t);
  std::sort(knots.begin(), knots.end());
  std::vector<double> starts;
  for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
    const double length = knots[i + 1] - knots[i];
    if (length < kSameInstant) continue;
    const int pieces = static_cast<int>(std::ceil(length / longest - 1e-9));
    for (int k = 0; k < pieces; ++k) starts.push_back(knots[i] + length * k / pieces);
  }
  starts.push_back(kControlPeriod);
  return starts;
}

}  // namespace

// Cuts the period at the switch of the command and, as the kind of feedback needs it, at the instant of measurement or
// into short pieces.
void CentrePredictor::add_subintervals(const AxisLoop& horizontal, const AxisLoop& vertical, double switch_time) {
  const double delay = horizontal.feedback_delay;
  double measured_at = 0;
  if (kind_ == Feedback::held) {
    const Periods d = periods(delay);
    sample_delay_ = d.whole + (d.rest > 0 ? 1 : 0);
    measured_at = d.rest > 0 ? kControlPeriod - d.rest : 0.0;
  }
  const double longest = kind_ == Feedback::delayed ? std::min(kLongestSegment, delay) : kControlPeriod;
  // Where a command or a push jumps, the feedback has a kink `delay` later.
  const double pushed = periods(delay).rest, switched = periods(switch_time + delay).rest;
  const auto starts = kind_ == Feedback::delayed ? pieces_of_period({switch_time, pushed, switched}, longest)
                                                 : pieces_of_period({switch_time, measured_at}, longest);
  for (std::size_t i = 0; i + 1 < starts.size(); ++i) {
    const double length = starts[i + 1] - starts[i];
    const bool closed = kind_ == Feedback::immediate;
    subintervals_.push_back({axis_step(horizontal, closed, length),
                             axis_step(vertical, closed, length),
                             length,
                             starts[i] > switch_time - kSameInstant,
                             kind_ == Feedback::held && std::abs(starts[i] - measured_at) < kSameInstant,
                             {},
                             {}});
  }
  if (kind_ != Feedback::delayed) return;

  const int count = static_cast<int>(subintervals_.size());
  int longest_back = 0;
  // The subinterval, `back` before subinterval i, that holds t (relative to this period's start) once `slack` is added.
  const auto locate = [&](int i, double t, double slack) {
    int back = 0;
    const auto start_of = [&](int b) {
      const int index = i - b, period = (index - count + 1) / count;  // floor division for index < count
      return starts[static_cast<std::size_t>(index - period * count)] + period * kControlPeriod;
    };
    while (start_of(back) > t + slack) ++back;
    longest_back = std::max(longest_back, back);
    return Lookup{back, t - start_of(back)};
  };
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    subintervals_[k].start = locate(i, starts[k] - delay, kSameInstant);
    subintervals_[k].end = locate(i, starts[k + 1] - delay, -kSameInstant);
  }
  past_.resize(static_cast<std::size_t>(longest_back) + 1);
}

Vec3 CentrePredictor::feedback(const Axes& x) const noexcept {
  return -kp_.cwiseProduct(x.row(0).transpose()) - kd_.cwiseProduct(x.row(1).transpose());
}

Vec3 CentrePredictor::feedback_rate(const Axes& x) const noexcept {
  return -kp_.cwiseProduct(x.row(1).transpose()) - kd_.cwiseProduct(x.row(2).transpose());
}

// Feedback and its rate where it was taken from: cubic Hermite over that past subinterval.
std::pair<Vec3, Vec3> CentrePredictor::past_feedback(const Lookup& at) const noexcept {
  // Subinterval 1 before the current one is the newest of the ring.
  const std::size_t back = static_cast<std::size_t>(at.back) - 1;
  const FeedbackPiece& piece = past_[(newest_ + past_.size() - back) % past_.size()];
  const double h = piece.length, x = at.s / h, y = 1 - x;
  const Vec3 value =
      y * y * ((1 + 2 * x) * piece.u0 + at.s * piece.du0) + x * x * ((1 + 2 * y) * piece.u1 - y * h * piece.du1);
  const Vec3 rate = 6 * x * y / h * (piece.u1 - piece.u0) + y * (1 - 3 * x) * piece.du0 + x * (1 - 3 * y) * piece.du1;
  return {value, rate};
}

CentrePredictor::Input CentrePredictor::delayed_input(const Subinterval& subinterval) const noexcept {
  const auto [u0, du0] = past_feedback(subinterval.start);
  const auto [u1, du1] = past_feedback(subinterval.end);
  Input u;
  for (int axis = 0; axis < 3; ++axis)
    u.col(axis) = cubic_through(u0[axis], du0[axis], u1[axis], du1[axis], subinterval.length);
  return u;
}

void CentrePredictor::run(const Subinterval& subinterval, const Vec3& r) noexcept {
  Input u = Input::Zero();
  if (kind_ == Feedback::held) u.row(0) = held_[static_cast<std::size_t>(sample_delay_)];
  if (kind_ == Feedback::delayed) u = delayed_input(subinterval);
  u.row(0) += r.transpose();

  Axes before = x_;
  if (!lag_) before.row(2) = u.row(0);
  x_.leftCols<2>() = subinterval.horizontal.E * before.leftCols<2>() + subinterval.horizontal.F * u.leftCols<2>();
  x_.col(2) = subinterval.vertical.E * before.col(2) + subinterval.vertical.F * u.col(2);
  if (kind_ == Feedback::delayed) {
    newest_ = (newest_ + 1) % past_.size();
    past_[newest_] = {subinterval.length, feedback(before), feedback_rate(before), feedback(x_), feedback_rate(x_)};
  }
}

// With ã = a + d for a, lag·ã′ = (u + d) − ã: the push adds to the input, and ã jumps with it.
State CentrePredictor::step(const Setpoint& command, const Vec3& push_W) noexcept {
  x_.row(2) += (push_W - push_W_).transpose();
  push_W_ = push_W;
  std::copy_backward(r_.begin(), r_.end() - 1, r_.end());
  r_[0] = kp_.cwiseProduct(command.p_W) + kd_.cwiseProduct(command.v_W) + command.a_W;
  const auto newer = static_cast<std::size_t>(command_delay_);
  if (kind_ == Feedback::held) std::copy_backward(held_.begin(), held_.end() - 1, held_.end());
  for (const Subinterval& subinterval : subintervals_) {
    if (subinterval.measure) held_[0] = feedback(x_);
    run(subinterval, (subinterval.new_command ? r_[newer] : r_[newer + 1]) + push_W);
  }
  state_ = {x_.row(0).transpose(), x_.row(1).transpose()};
  a_W_ = x_.row(2).transpose();
  return state_;
}

}  // namespace backwash::reach

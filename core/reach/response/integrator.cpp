// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/response/integrator.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/reach/reach_tube.hpp"
#include "core/reach/response/response_builder.hpp"

namespace backwash::reach {
namespace {

constexpr double kLongestStep = 1e-3;   // s
constexpr double kLongestCharge = 600;  // s: a loop that has not settled after this is refused
constexpr double kSettled = 1e-5;       // share of the largest motion
constexpr double kLeastMotion = 1e-3;   // m/s²: a loop without delay and lag follows a command with none at all
constexpr double kHalfHold = kControlPeriod / 2;  // s: so late is a held place on the mean, a held acceleration not
constexpr double kHeldMargin = 1.01;              // covers the trapezoid rule and what comes after kSettled

/// What an axis starts with, of size 1: an impulse of the disturbance; one of the commanded acceleration, of which
/// velocity and place are the integrals; an error that the delayed feedback has seen all the time before.
enum class Start { disturbance, command, position, velocity };

/// One axis with its integrator, moved on in steps that the feedback delay is a multiple of.
class ChargedAxis {
 public:
  /// `late`: by how much the place and the velocity that are commanded follow the acceleration, s.
  ChargedAxis(const AxisLoop& axis, Start start, double late = 0)
      : axis_(axis),
        commanded_(start == Start::command),
        late_(late),
        delay_(static_cast<std::size_t>(std::ceil(axis.feedback_delay / kLongestStep))) {
    h_ = delay_ > 0 ? axis.feedback_delay / static_cast<double>(delay_) : kLongestStep;
    move_ = axis_step(axis, delay_ == 0, h_);
    x_[start == Start::position              ? 0
       : commanded_ && axis.attitude_lag > 0 ? 2
                                             : 1] = commanded_ && axis.attitude_lag > 0 ? 1 / axis.attitude_lag : 1;
    const bool seen = start == Start::position || start == Start::velocity;
    fed_back_.assign(delay_ + 1, seen ? feedback() : 0.0);
    fed_back_[0] = feedback();
  }
  void step() {
    const bool heard = commanded_ && t_ >= late_ - h_ / 2;
    const double command = heard ? axis_.kp * (t_ - late_) + axis_.kd : 0, command_rate = heard ? axis_.kp : 0;
    const std::size_t n = fed_back_.size(), oldest = (newest_ + 1) % n, next = (newest_ + 2) % n;
    const double late = delay_ > 0 ? fed_back_[oldest] : 0, late_after = delay_ > 0 ? fed_back_[next] : 0;
    const double seen = command + (delay_ > 0 ? late : feedback());
    const double rate = axis_.velocity_integrator / axis_.kd;
    x_ = move_.E * x_ +
         move_.F * Eigen::Vector4d(command + late + held_, command_rate + (late_after - late) / h_ + rate * seen, 0, 0);
    t_ += h_;
    if (delay_ > 0) {
      newest_ = oldest;
      fed_back_[newest_] = feedback();
    }
    const double seen_after = command + command_rate * h_ + (delay_ > 0 ? late_after : feedback());
    held_ += h_ * rate * (seen + seen_after) / 2;
  }
  double t() const { return t_; }
  double h() const { return h_; }
  double held() const { return held_; }
  /// How far it is from rest, m/s². What is commanded is met by what was measured: late, the craft is ahead of it.
  double motion() const {
    const double p = x_[0] - (commanded_ ? t_ + axis_.feedback_delay - late_ : 0), v = x_[1] - (commanded_ ? 1 : 0);
    return axis_.kp * std::abs(p) + axis_.kd * std::abs(v) + std::abs(held_);
  }

 private:
  double feedback() const { return -axis_.kp * x_[0] - axis_.kd * x_[1]; }

  AxisLoop axis_;
  bool commanded_;
  double late_;
  std::size_t delay_, newest_ = 0;  // steps
  double h_ = 0, t_ = 0, held_ = 0;
  AxisStep move_;
  Eigen::Vector3d x_ = Eigen::Vector3d::Zero();
  std::vector<double> fed_back_;  // ring of the last delay_ + 1
};

/// Runs until the axis has been at rest for a second; each(mean of what is held over a step, its time, its length).
template <typename Each>
void run_until_settled(ChargedAxis axis, const AxisLoop& loop, const Each& each) {
  double largest = std::max(kLeastMotion, axis.motion()), last_moving = 0;
  while (axis.t() - last_moving < 1) {
    const double before = axis.held(), t = axis.t();
    axis.step();
    each((before + axis.held()) / 2, t, axis.h());
    largest = std::max(largest, axis.motion());
    if (axis.motion() > kSettled * largest) last_moving = axis.t();
    if (!(axis.motion() < 1e9) || axis.t() > kLongestCharge)
      refuse(loop,
             "with its velocity_integrator it does not settle within ten minutes; it is unstable, or that gain is "
             "too low");
  }
}

}  // namespace

double IntegratorResponse::opposed() const { return std::accumulate(opposite.begin(), opposite.end(), 0.0); }

IntegratorResponse integrator_response(const AxisLoop& axis) {
  IntegratorResponse response;
  if (!(axis.velocity_integrator > 0)) return response;
  AxisLoop counted = axis;
  if (counted.feedback_delay > 0) counted.feedback_delay = std::max(counted.feedback_delay, kMinFeedbackDelay);
  run_until_settled(ChargedAxis(counted, Start::disturbance), axis, [&](double held, double t, double h) {
    const auto bin = static_cast<std::size_t>(t / kControlPeriod);
    response.kernel.resize(bin + 1);
    response.opposite.resize(bin + 1);
    response.kernel[bin] += kHeldMargin * h * std::abs(held);
    response.opposite[bin] += kHeldMargin * h * std::max(0.0, held);  // c = −held
  });
  for (const double late : {0.0, kHalfHold}) {
    double sum = 0;
    run_until_settled(ChargedAxis(counted, Start::command, late), axis,
                      [&](double held, double, double h) { sum += kHeldMargin * h * std::abs(held); });
    response.manoeuvre = std::max(response.manoeuvre, sum);
  }
  const auto peak_after = [&](Start start) {
    double peak = 0;
    run_until_settled(ChargedAxis(counted, start), axis,
                      [&](double held, double, double) { peak = std::max(peak, kHeldMargin * std::abs(held)); });
    return peak;
  };
  response.from_position = peak_after(Start::position);
  response.from_velocity = peak_after(Start::velocity);
  return response;
}

namespace {

/// Of gusts with variance 1 and correlation e^{−|τ|/τ_w}: variance of what is held at most, and its covariance with
/// them where it is held the other way.
std::pair<double, double> held_of_gusts(const IntegratorResponse& response, double tau_w) {
  const double rho = std::exp(-kControlPeriod / tau_w);
  double shaped = 0, variance = 0, covariance = 0, age = 1;
  const auto spread = [&](double charge) {  // |c| after the filter that makes such gusts of white noise
    const double before = shaped;
    shaped = rho * shaped + std::sqrt(2 / tau_w) * charge;
    variance += kControlPeriod * std::max(before * before, shaped * shaped);
  };
  for (std::size_t j = 0; j < response.kernel.size(); ++j, age *= rho) {
    spread(response.kernel[j]);
    covariance += age * response.opposite[j];
  }
  while (shaped * shaped > 1e-6 * variance) spread(0);
  return {variance, covariance};
}

}  // namespace

NetDisturbance::NetDisturbance(const Reachability& reach, const BoundField& bounds)
    : NetDisturbance(reach,
                     has_integrator(reach.vehicle) ? bounds.extremes(reach.vehicle.limits.v_max) : FieldExtremes(),
                     bounds.model()) {}

NetDisturbance::NetDisturbance(const Reachability& reach, const FieldExtremes& most, const BoundModel& model)
    : held_(has_integrator(reach.vehicle)) {
  if (!held_) return;
  const auto& limits = reach.vehicle.limits;
  const auto& first = reach.vehicle.initial_error;
  for (std::size_t d = 0; d < kDirections; ++d) {
    const IntegratorResponse& response = d == kZ ? reach.vertical_integrator : reach.horizontal_integrator;
    const auto [variance, covariance] = held_of_gusts(response, std::max(model.tau_w, kControlPeriod));
    const Vec3 along = unit(static_cast<Direction>(d)).cwiseAbs();
    const double beyond = 1 + response.opposed();
    mean_[d] = d == kZ ? model.mean_vertical : model.mean_horizontal;
    steady_[d] = (2 * beyond - 1) * (d == kZ ? most.vertical : most.level) + beyond * along.dot(most.push_range) +
                 along.sum() * (limits.a_max * response.manoeuvre + first.position * response.from_position +
                                first.velocity * response.from_velocity);
    gusts_squared_[d] = variance * most.gusts.w[d] * most.gusts.w[d];
    against_[d] = covariance * most.gusts.w[d];
  }
}

DisturbanceBound NetDisturbance::operator()(DisturbanceBound w_bar) const noexcept {
  for (std::size_t d = 0; held_ && d < kDirections; ++d) {
    const double gust = std::max(0.0, w_bar.w[d] - mean_[d]);
    w_bar.w[d] = mean_[d] + std::sqrt(gust * (gust + 2 * against_[d]) + gusts_squared_[d]) + steady_[d];
  }
  return w_bar;
}

}  // namespace backwash::reach

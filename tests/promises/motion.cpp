// SPDX-License-Identifier: BSD-3-Clause
#include "tests/promises/motion.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::promises {
namespace {

using Square = Eigen::Matrix<double, 11, 11>;

Square exponential(Square m) {
  int halvings = 0;
  for (double norm = m.cwiseAbs().rowwise().sum().maxCoeff(); norm > 0.25; norm /= 2) ++halvings;
  m *= std::pow(0.5, halvings);
  Square sum = Square::Identity(), term = Square::Identity();
  for (int n = 1; n <= 12; ++n) {
    term = term * m / n;
    sum += term;
  }
  for (int n = 0; n < halvings; ++n) sum = sum * sum;
  return sum;
}

}  // namespace

Motions::Motions(const Plant& plant, const Lanes& p, const Lanes& v, const Lanes& a)
    : plant_(plant), closed_(plant.delay == 0 && !plant.sampled), past_(static_cast<std::size_t>(plant.delay)) {
  Square m = Square::Zero();
  const int answers = plant.lag > 0 ? kA : kV;
  const double share = plant.lag > 0 ? 1 / plant.lag : 1, rate = plant.ki / plant.kd;
  m(kP, kV) = 1;
  m(kV, kW) = 1;
  if (plant.lag > 0) {
    m(kV, kA) = 1;
    m(kA, kA) = -share;
  }
  for (const int input : {kOff, kCommand, kI}) m(answers, input) = share;
  m(kI, kOff) = rate;
  if (closed_) {
    m(answers, kP) -= share * plant.kp;
    m(answers, kV) -= share * plant.kd;
    m(kI, kP) = -rate * plant.kp;
    m(kI, kV) = -rate * plant.kd;
  } else {
    m(answers, kF0) = share;
    m(kI, kF0) = rate;
  }
  for (int n = kF0; n < kF3; ++n) m(n, n + 1) = 1;
  move_ = exponential(plant.step() * m).topRows<4>().transpose();
  z_.setZero();
  z_.col(kP) = p;
  z_.col(kV) = v;
  z_.col(kA) = a;
  const Lanes before = feedback();
  for (Fed& fed : past_) fed = {before, Lanes::Zero(), before, Lanes::Zero()};
}

Motions::Lanes Motions::acceleration() const {
  if (plant_.lag > 0) return (z_.col(kA) + z_.col(kW)).array();
  const Lanes fed = closed_ ? feedback() : Lanes(z_.col(kF0));
  return (z_.col(kOff) + z_.col(kCommand) + z_.col(kI) + z_.col(kW)).array() + fed;
}

void Motions::take_feedback() {
  if (closed_) return;
  const auto oldest = past_.empty() ? 0 : count_ % past_.size();
  if (plant_.sampled) {
    if (count_ % static_cast<std::size_t>(plant_.per_period) != 0) return;
    z_.col(kF0) = past_.empty() ? feedback() : past_[oldest].f0;
    return;
  }
  const double h = plant_.step();
  const Fed& fed = past_[oldest];
  z_.col(kF0) = fed.f0;
  z_.col(kF1) = fed.f1;
  z_.col(kF2) = (6 * (fed.end0 - fed.f0) - 2 * h * (2 * fed.f1 + fed.end1)) / (h * h);
  z_.col(kF3) = (12 * (fed.f0 - fed.end0) + 6 * h * (fed.f1 + fed.end1)) / (h * h * h);
}

void Motions::step(const Lanes& off, const Lanes& a_cmd, const Lanes& w) {
  z_.col(kOff) = off;
  z_.col(kCommand) = a_cmd;
  z_.col(kW) = w;
  take_feedback();
  const auto slope = [&]() -> Lanes { return -plant_.kp * v() - plant_.kd * acceleration(); };
  Fed fed;
  const bool keep = !past_.empty();
  if (keep) {
    fed.f0 = feedback();
    fed.f1 = slope();
  }
  const Eigen::Matrix<double, kLanes, 4> next = z_ * move_;
  if (keep && plant_.lag <= 0) {  // the input at the end of the step, for the slope there
    const double h = plant_.step();
    z_.col(kF0) += h * (z_.col(kF1) + h / 2 * (z_.col(kF2) + h / 3 * z_.col(kF3)));
  }
  z_.leftCols<4>() = next;
  if (keep) {
    fed.end0 = feedback();
    fed.end1 = slope();
    past_[count_ % past_.size()] = fed;
  }
  ++count_;
}

Answer::Answer(const Plant& plant, int steps) : per_period(plant.per_period) {
  using Lanes = Motions::Lanes;
  constexpr int kFirst = 2;  // lane of the first push
  const int pushes = plant.sampled ? plant.per_period : 1;
  Lanes p = Lanes::Zero(), v = Lanes::Zero();
  p[0] = v[1] = 1;
  Motions motions(plant, p, v, Lanes::Zero());
  push.resize(static_cast<std::size_t>(pushes));
  charge.resize(push.size());
  for (int n = 0; n <= steps; ++n) {
    const Lanes at = motions.p(), held = motions.held();
    from_position.push_back(at[0]);
    from_velocity.push_back(at[1]);
    for (int lane = 0; lane < pushes; ++lane) {
      push[static_cast<std::size_t>(lane)].push_back(at[kFirst + lane]);
      charge[static_cast<std::size_t>(lane)].push_back(held[kFirst + lane]);
    }
    Lanes w = Lanes::Zero();
    if (n < pushes) w[kFirst + n] = 1;
    motions.step(Lanes::Zero(), Lanes::Zero(), w);
  }
  const double h = plant.step();
  for (std::size_t n = 1; n < from_position.size(); ++n) {
    const auto acceleration = [&](const std::vector<double>& x) {
      return plant.kp * std::abs(x[n]) + plant.kd * std::abs(x[n] - x[n - 1]) / h;
    };
    reach += std::abs(push[0][n]);
    speed += std::abs(push[0][n] - push[0][n - 1]) / h;
    by_position = std::max(by_position, acceleration(from_position));
    by_velocity = std::max(by_velocity, acceleration(from_velocity));
  }
  by_push = 1 + plant.kp * reach + plant.kd * speed;
}

}  // namespace backwash::promises

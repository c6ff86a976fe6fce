// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/centre_adjoint.hpp"

namespace backwash::plan {

namespace {
constexpr std::size_t kLongestResponse = 1000;  ///< periods
constexpr double kForgotten = 1e-8;             ///< share of the peak below which the rest of a response is dropped
}  // namespace

CentreAdjoint::CentreAdjoint(const Vehicle& vehicle, reach::Loop loop) {
  const auto& c = vehicle.controller;
  kp_ = {c.kp.horizontal, c.kp.horizontal, c.kp.vertical};
  kd_ = {c.kd.horizontal, c.kd.horizontal, c.kd.vertical};
  reach::CentrePredictor predictor(vehicle, loop, State{}, Vec3::Zero(), Setpoint{});
  Setpoint command;
  command.a_W = Vec3::Ones();
  double peak = 0;
  std::size_t length = 0;
  for (std::size_t k = 0; k < kLongestResponse; ++k) {
    const State s = predictor.step(command);
    command = {};
    position_.push_back(s.p_W);
    velocity_.push_back(s.v_W);
    const double size = s.p_W.norm() + s.v_W.norm();
    peak = std::max(peak, size);
    if (size > kForgotten * peak) length = k + 1;
  }
  position_.resize(length);
  velocity_.resize(length);
}

CentreAdjoint::CommandGradient CentreAdjoint::pull_back(std::span<const Vec3> by_position,
                                                        std::span<const Vec3> by_velocity) const {
  const std::size_t n = by_position.size();
  std::vector<Vec3> by_r(n, Vec3::Zero());
  for (std::size_t k = 0; k < n; ++k) {
    if (by_position[k].isZero(0) && by_velocity[k].isZero(0)) continue;
    for (std::size_t i = 0; i < position_.size() && i <= k; ++i)
      by_r[k - i] += by_position[k].cwiseProduct(position_[i]) + by_velocity[k].cwiseProduct(velocity_[i]);
  }
  CommandGradient gradient{by_r, by_r, by_r};
  for (std::size_t k = 0; k < n; ++k) {
    gradient.p[k] = by_r[k].cwiseProduct(kp_);
    gradient.v[k] = by_r[k].cwiseProduct(kd_);
  }
  return gradient;
}

}  // namespace backwash::plan

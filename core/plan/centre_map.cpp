// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/centre_map.hpp"

namespace backwash::plan {

namespace {
constexpr int kLongestDelay = 18;  ///< periods after which a command acts only through the state
}

CentreAdjoint::CentreAdjoint(const Vehicle& vehicle, reach::Loop loop)
    : horizontal_(identify(vehicle, loop, 0)), vertical_(identify(vehicle, loop, 2)) {}

CentreAdjoint::Axis CentreAdjoint::identify(const Vehicle& vehicle, reach::Loop loop, int axis) {
  const auto& c = vehicle.controller;
  Axis result{{}, {}, axis == 2 ? c.kp.vertical : c.kp.horizontal, axis == 2 ? c.kd.vertical : c.kd.horizontal};
  const Vec3 e = Vec3::Unit(axis);
  const auto state_of = [&](const reach::CentrePredictor& predictor) {
    return Eigen::Vector3d(predictor.state().p_W[axis], predictor.state().v_W[axis], predictor.acceleration()[axis]);
  };
  for (int column = 0; column < 3; ++column) {
    const State unit_state{column == 0 ? e : Vec3::Zero(), column == 1 ? e : Vec3::Zero()};
    reach::CentrePredictor predictor(vehicle, loop, unit_state, column == 2 ? e : Vec3::Zero(), Setpoint{});
    predictor.step(Setpoint{});
    result.A.col(column) = state_of(predictor);
  }
  // Response to one command with r = 1; what A does not carry over is B_i.
  reach::CentrePredictor predictor(vehicle, loop, State{}, Vec3::Zero(), Setpoint{});
  Setpoint impulse;
  impulse.a_W = e;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  std::size_t used = 0;
  for (int i = 0; i < kLongestDelay; ++i) {
    predictor.step(i == 0 ? impulse : Setpoint{});
    const Eigen::Vector3d now = state_of(predictor);
    result.B.push_back(now - result.A * before);
    if (result.B.back().norm() > 1e-12) used = result.B.size();
    before = now;
  }
  result.B.resize(used);
  return result;
}

CentreAdjoint::CommandGradient CentreAdjoint::pull_back(std::span<const Vec3> by_position,
                                                        std::span<const Vec3> by_velocity) const {
  const std::size_t n = by_position.size();
  CommandGradient gradient{std::vector<Vec3>(n), std::vector<Vec3>(n), std::vector<Vec3>(n)};
  std::vector<Eigen::Vector3d> costate(n);
  for (int axis = 0; axis < 3; ++axis) {
    const Axis& system = axis == 2 ? vertical_ : horizontal_;
    const Eigen::Matrix3d At = system.A.transpose();
    Eigen::Vector3d lambda = Eigen::Vector3d::Zero();
    for (std::size_t k = n; k-- > 0;) {
      lambda = At * lambda + Eigen::Vector3d(by_position[k][axis], by_velocity[k][axis], 0);
      costate[k] = lambda;
      double by_r = 0;
      for (std::size_t i = 0; i < system.B.size() && k + i < n; ++i) by_r += system.B[i].dot(costate[k + i]);
      gradient.p[k][axis] = system.kp * by_r;
      gradient.v[k][axis] = system.kd * by_r;
      gradient.a[k][axis] = by_r;
    }
  }
  return gradient;
}

}  // namespace backwash::plan

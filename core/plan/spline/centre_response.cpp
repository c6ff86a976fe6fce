// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/spline/centre_response.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::plan {

namespace {
constexpr std::size_t kLongestResponse = 1000;  ///< periods
constexpr double kForgotten = 1e-7;             ///< share of the peak below which the rest of a response is dropped
}  // namespace

CentreResponse::CentreResponse(const Vehicle& vehicle, reach::Loop loop)
    : horizontal_{vehicle.controller.kp.horizontal, vehicle.controller.kd.horizontal, {}, {}},
      vertical_{vehicle.controller.kp.vertical, vehicle.controller.kd.vertical, {}, {}} {
  reach::CentrePredictor predictor(vehicle, loop, State{}, Vec3::Zero(), Setpoint{});
  Setpoint command;
  command.a_W = Vec3::Ones();
  double peak = 0;
  std::size_t length = 0;
  for (std::size_t k = 0; k < kLongestResponse; ++k) {
    const State s = predictor.step(command);
    command = {};
    horizontal_.position.push_back(s.p_W.x());
    horizontal_.velocity.push_back(s.v_W.x());
    vertical_.position.push_back(s.p_W.z());
    vertical_.velocity.push_back(s.v_W.z());
    const double size = s.p_W.norm() + s.v_W.norm();
    peak = std::max(peak, size);
    if (size > kForgotten * peak) length = k + 1;
  }
  for (Axis* axis : {&horizontal_, &vertical_}) {
    axis->position.resize(length);
    axis->velocity.resize(length);
  }
}

MotionBasis CentreResponse::basis(std::size_t control_points, double knot_span, std::size_t samples,
                                  std::size_t stride) const {
  const auto rows = static_cast<Eigen::Index>(samples), columns = static_cast<Eigen::Index>(control_points - 6);
  const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(rows, columns);
  MotionBasis basis{zero, zero, zero, zero};
  for (std::size_t point = 3; point + 3 < control_points; ++point) {
    add(horizontal_, point, control_points, knot_span, stride, basis.P_horizontal, basis.V_horizontal);
    add(vertical_, point, control_points, knot_span, stride, basis.P_vertical, basis.V_vertical);
  }
  return basis;
}

void CentreResponse::add(const Axis& axis, std::size_t point, std::size_t control_points, double knot_span,
                         std::size_t stride, Eigen::MatrixXd& P, Eigen::MatrixXd& V) const {
  // The commands that the point moves: t inside the four spans of its support. A free point leaves the end alone.
  const auto begin = static_cast<std::size_t>(std::floor(static_cast<double>(point - 3) * knot_span / kControlPeriod));
  std::vector<double> r;
  for (std::size_t k = begin;; ++k) {
    const double t = static_cast<double>(k) * kControlPeriod;
    if (t >= static_cast<double>(point + 1) * knot_span) break;
    const std::size_t first = weights(control_points, knot_span, t, 0).first;
    if (point < first || point > first + 3) {
      r.push_back(0);
      continue;
    }
    const auto weight = [&](int order) { return weights(control_points, knot_span, t, order).weight[point - first]; };
    r.push_back(axis.kp * weight(0) + axis.kd * weight(1) + weight(2));
  }
  const auto column = static_cast<Eigen::Index>(point - 3);
  const std::size_t length = axis.position.size();
  for (std::size_t m = begin / stride; m < static_cast<std::size_t>(P.rows()); ++m) {
    const std::size_t now = (m + 1) * stride;  // commands given so far
    if (now >= begin + r.size() + length) break;
    double p = 0, v = 0;
    for (std::size_t k = now > begin + length ? now - begin - length : 0; k < r.size() && begin + k < now; ++k) {
      const std::size_t age = now - 1 - begin - k;
      p += r[k] * axis.position[age];
      v += r[k] * axis.velocity[age];
    }
    P(static_cast<Eigen::Index>(m), column) = p;
    V(static_cast<Eigen::Index>(m), column) = v;
  }
}

}  // namespace backwash::plan

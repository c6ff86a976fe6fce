// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/emulation/airframe.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/types/geometry.hpp"

namespace backwash::bench {
namespace {

constexpr double kG = 9.80665;
// Where each rotor is, in arms, and the sense of its moment about the body's z: against its own turning.
constexpr double kX[] = {1, -1, 1, -1}, kY[] = {-1, 1, 1, -1}, kMoment[] = {-1, -1, 1, 1};

}  // namespace

Airframe::Airframe(const Vehicle& vehicle, const Vec3& ground_W)
    : vehicle_(vehicle),
      floor_(ground_W.z()),
      arm_((vehicle.body.radius - vehicle.body.rotor_radius) / std::numbers::sqrt2),
      inertia_(vehicle.body.mass * vehicle.body.radius * vehicle.body.radius * Vec3(0.25, 0.25, 0.5)),
      state_{ground_W, Vec3::Zero()} {}

double Airframe::commanded(double u) const noexcept {
  const double f = vehicle_.propulsion.thr_mdl_fac, x = std::clamp(u, 0.0, 1.0);
  return vehicle_.propulsion.max_thrust / 4 * (f * x * x + (1 - f) * x);
}

double Airframe::thrust() const noexcept {
  return std::accumulate(thrust_.begin(), thrust_.end(), 0.0) / vehicle_.propulsion.max_thrust;
}

Vec3 Airframe::specific_force() const { return attitude_.conjugate() * (acceleration_ + kG * Vec3::UnitZ()); }

void Airframe::step(const Rotors& commands, const Vec3& w_W) {
  double lift = 0;
  Vec3 moment = Vec3::Zero();
  for (std::size_t i = 0; i < thrust_.size(); ++i) {
    thrust_[i] += (commanded(commands[i]) - thrust_[i]) * kStep / kRotorLag;
    lift += thrust_[i];
    moment += thrust_[i] * Vec3(arm_ * kY[i], -arm_ * kX[i], kYawMoment * kMoment[i]);
  }
  const double m = vehicle_.body.mass;
  acceleration_ = attitude_ * Vec3(0, 0, lift / m) - kG * Vec3::UnitZ() - kDrag / m * state_.v_W + w_W;
  on_ground_ = state_.p_W.z() <= floor_ && lift < m * kG;
  if (on_ground_) {  // it stands on its feet, level
    state_ = {{state_.p_W.x(), state_.p_W.y(), floor_}, Vec3::Zero()};
    acceleration_ = rates_ = Vec3::Zero();
    const Vec3 x = attitude_ * Vec3::UnitX();
    attitude_ = Eigen::AngleAxisd(std::atan2(x.y(), x.x()), Vec3::UnitZ());
    return;
  }
  rates_ += kStep * ((moment - rates_.cross(inertia_.cwiseProduct(rates_))).cwiseQuotient(inertia_));
  const double turn = rates_.norm() * kStep;
  if (turn > 0) attitude_ = (attitude_ * Eigen::AngleAxisd(turn, rates_.normalized())).normalized();
  state_.v_W += kStep * acceleration_;
  state_.p_W += kStep * state_.v_W;
  if (state_.p_W.z() < floor_) {
    state_.p_W.z() = floor_;
    state_.v_W.z() = std::max(0.0, state_.v_W.z());
  }
}

}  // namespace backwash::bench

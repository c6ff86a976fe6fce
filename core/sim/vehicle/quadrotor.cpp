// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/vehicle/quadrotor.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

#include "core/types/thrust.hpp"

namespace backwash::sim {
namespace {

const Vec3 kGravityUp{0, 0, kGravity};

long steps_in(double seconds) { return std::lround(seconds / Quadrotor::kStep); }

}  // namespace

Quadrotor::Quadrotor(const Vehicle& vehicle, const State& start, std::optional<double> z_floor)
    : vehicle_(vehicle),
      loop_(vehicle),
      state_(start),
      z_floor_(z_floor),
      feedback_(static_cast<std::size_t>(steps_in(loop_.feedback_delay)), start) {
  active_.p_W = start.p_W;
  on_ground_ = z_floor && start.p_W.z() <= *z_floor;
}

void Quadrotor::command(const Setpoint& setpoint) {
  in_transit_.emplace_back(steps_ + steps_in(loop_.latency), setpoint);
}

Vec3 Quadrotor::specific_force(const State& believed) noexcept {
  if (!motors_on_ || on_ground_) integrated_.setZero();
  if (!motors_on_) return Vec3::Zero();
  const Vec3 u = loop_.asked(active_, believed);
  // Height goes before sideways motion: limit the vertical part, then what is left of thrust and tilt.
  const double max = vehicle_.propulsion.max_thrust / vehicle_.body.mass, min = kMinThrust * max;
  Vec3 f = u + integrated_ + kGravityUp;
  const Vec3 asked = f;
  f.z() = std::clamp(f.z(), min, max);
  const double horizontal = f.head<2>().norm();
  const double allowed = std::min(std::tan(kMaxTilt) * f.z(), std::sqrt(max * max - f.z() * f.z()));
  if (horizontal > allowed) f.head<2>() *= allowed / horizontal;
  // Held at the limits, as autopilots do: what cannot be given is not asked for ever more.
  if (loop_.ki != Vec3::Zero() && !on_ground_ && f == asked)
    integrated_ += kStep * loop_.ki.cwiseQuotient(loop_.kd).cwiseProduct(u - active_.a_W);
  return f;
}

double Quadrotor::commanded_thrust() const noexcept { return (produced_ + kGravityUp).norm(); }

/// Acceleration by the rotors, gravity removed, when the simulation without terms produces `produced`.
Vec3 Quadrotor::given(const Vec3& produced) {
  if (thrust_terms_.none()) return produced;
  const Vec3 force = produced + kGravityUp;
  const double nominal = force.norm();
  if (!(nominal > 1e-6)) return produced;
  return force * (thrust_terms_.step(nominal, time(), voltage_, kStep) / nominal) - kGravityUp;
}

void Quadrotor::step(const Vec3& w_W, const State& estimated) {
  while (!in_transit_.empty() && in_transit_.front().first <= steps_) {
    active_ = in_transit_.front().second;
    in_transit_.pop_front();
  }
  State believed = estimated;
  if (!feedback_.empty()) std::swap(believed, feedback_[static_cast<std::size_t>(steps_) % feedback_.size()]);
  const Vec3 wanted = specific_force(believed) - kGravityUp;

  const Vec3 before = loop_.attitude_lag > 0 ? produced_ : wanted;
  produced_ = loop_.after(produced_, wanted, kStep);
  const State start = state_;
  acceleration_ = given(0.5 * (before + produced_)) + w_W;
  state_.v_W += kStep * acceleration_;
  state_.p_W += kStep * 0.5 * (start.v_W + state_.v_W);

  // What comes down does not pass through, even while it brakes.
  const bool upwards = acceleration_.z() > 0 && state_.v_W.z() >= 0;
  on_ground_ = z_floor_ && state_.p_W.z() <= *z_floor_ && !upwards;
  if (on_ground_) {  // friction holds it where it stands
    state_.p_W = Vec3(start.p_W.x(), start.p_W.y(), *z_floor_);
    state_.v_W = acceleration_ = Vec3::Zero();
  }
  const double turn = std::remainder(active_.yaw - yaw_, 2 * std::numbers::pi);
  yaw_ += std::clamp(turn, -kMaxYawRate * kStep, kMaxYawRate * kStep);
  ++steps_;
}

Eigen::Quaterniond Quadrotor::attitude() const {
  const Vec3 force = produced_ + kGravityUp;
  const Vec3 z = !on_ground_ && force.norm() > 1e-6 ? Vec3(force.normalized()) : Vec3(Vec3::UnitZ());
  const Vec3 x = Vec3(-std::sin(yaw_), std::cos(yaw_), 0).cross(z).normalized();  // its heading is the yaw exactly
  Mat3 R_WB;
  R_WB << x, z.cross(x), z;
  return Eigen::Quaterniond(R_WB);
}

double Quadrotor::thrust() const noexcept {
  const double share = vehicle_.body.mass * commanded_thrust() / vehicle_.propulsion.max_thrust;
  return std::clamp(thrust_command(vehicle_, share), 0.0, 1.0);
}

}  // namespace backwash::sim

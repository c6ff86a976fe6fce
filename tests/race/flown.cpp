// SPDX-License-Identifier: BSD-3-Clause
#include "tests/race/flown.hpp"

#include <algorithm>
#include <cmath>

#include "core/sim/vehicle/quadrotor.hpp"

namespace backwash::race {

Flown::Flown(const map::OccupancyGrid& grid, const Vehicle& vehicle, const Vec3& at_W, std::uint64_t seed,
             double strength, int steps, double lattice)
    : vehicle_(vehicle),
      steps_(steps),
      lattice_(lattice),
      air_(grid, vehicle, seed, strength),
      vio_(0.75 * vehicle.estimation.position, seed + 1),
      random_(seed + 2),
      truth_{at_W, Vec3::Zero()} {
  active_.p_W = at_W;
  const double step = kControlPeriod / steps;
  late_.assign(static_cast<std::size_t>(std::lround(vehicle.controller.feedback_delay / step)), truth_);
}

Vec3 Flown::wanted(const State& believed) const noexcept {
  const auto& c = vehicle_.controller;
  const Vec3 kp{c.kp.horizontal, c.kp.horizontal, c.kp.vertical}, kd{c.kd.horizontal, c.kd.horizontal, c.kd.vertical};
  Vec3 f = active_.a_W + kp.cwiseProduct(active_.p_W - believed.p_W) + kd.cwiseProduct(active_.v_W - believed.v_W);
  // As Quadrotor: height goes first, then what is left of thrust and tilt.
  const double max = vehicle_.propulsion.max_thrust / vehicle_.body.mass;
  f.z() = std::clamp(f.z() + kGravity, sim::Quadrotor::kMinThrust * max, max);
  const double horizontal = f.head<2>().norm();
  const double allowed = std::min(std::tan(sim::Quadrotor::kMaxTilt) * f.z(), std::sqrt(max * max - f.z() * f.z()));
  if (horizontal > allowed) f.head<2>() *= allowed / horizontal;
  f.z() -= kGravity;
  return f;
}

void Flown::fly(const Setpoint& command) {
  const double dt = kControlPeriod / steps_, lag = vehicle_.controller.attitude_lag, kept = std::exp(-dt / lag);
  in_transit_.emplace_back(step_ + std::lround(vehicle_.controller.latency / dt), command);
  State off = vio_.estimate({}, static_cast<double>(step_) * dt);
  const double share = 0.25 * vehicle_.estimation.position / std::sqrt(3.0);
  std::uniform_real_distribution<double> uniform(-share, share);
  std::normal_distribution<double> normal(0, 0.01);
  for (int axis = 0; axis < 3; ++axis) {
    off.p_W[axis] += uniform(random_);
    off.v_W[axis] += normal(random_);
  }
  felt_.setZero();
  for (int i = 0; i < steps_; ++i, ++step_) {
    while (!in_transit_.empty() && in_transit_.front().first <= step_) {
      active_ = in_transit_.front().second;
      in_transit_.pop_front();
    }
    State believed{truth_.p_W + off.p_W, truth_.v_W + off.v_W};
    if (!late_.empty()) {
      late_.push_back(believed);
      believed = late_.front();
      late_.pop_front();
    }
    const Vec3 u = wanted(believed);
    // The flow is cast on a lattice: it changes over decimetres.
    const Vec3 cell = lattice_ > 0 ? Vec3(lattice_ * (truth_.p_W / lattice_).array().round()) : truth_.p_W;
    const Vec3 w = air_.step(cell, dt), mean = u + lag / dt * (1 - kept) * (produced_ - u);
    produced_ = u + kept * (produced_ - u);
    felt_ += w / steps_;
    truth_.p_W += dt * truth_.v_W + dt * dt / 2 * (mean + w);
    truth_.v_W += dt * (mean + w);
  }
  for (int axis = 0; axis < 3; ++axis) felt_[axis] += 2 * normal(random_);
}

bool touches(const map::OccupancyGrid& grid, const map::DistanceField& distance, const Vehicle& vehicle,
             std::span<const Setpoint> commands, const Vec3& start_W, std::uint64_t seed, double strength) {
  Flown flight(grid, vehicle, start_W, seed, strength);
  Setpoint hover;
  hover.p_W = start_W;
  for (int k = 0; k < 50; ++k) flight.fly(hover);
  const double slack = grid.resolution() * std::sqrt(3.0), radius = vehicle.body.radius;
  for (const Setpoint& command : commands) {
    flight.fly(command);
    const Vec3& p = flight.truth().p_W;
    if (distance.interpolated(p) - slack < radius && distance.exact(grid, p) < radius) return true;
  }
  return false;
}

std::pair<Vec3, Vec3> hover_disturbance(const map::OccupancyGrid& grid, const Vehicle& vehicle, const Vec3& at_W,
                                        std::uint64_t seed, double strength) {
  Flown flight(grid, vehicle, at_W, seed, strength);
  Setpoint hold;
  hold.p_W = at_W;
  Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
  int n = 0;
  for (int k = 0; k < 1100; ++k) {
    flight.fly(hold);
    if (k >= 100) {
      sum += flight.felt();
      squares += flight.felt().cwiseAbs2();
      ++n;
    }
  }
  return {sum / n, squares / n - (sum / n).cwiseAbs2()};
}

}  // namespace backwash::race

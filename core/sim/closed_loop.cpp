// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "core/sim/flight.hpp"

namespace backwash::sim {

ClosedLoop::ClosedLoop(const map::OccupancyGrid& grid, const Vehicle& vehicle, const State& start, std::uint64_t seed,
                       double strength)
    : quadrotor_(vehicle, start),
      airflow_(grid, vehicle, seed, strength),
      // The sets reserve estimation.position; an estimate that used all of it would leave nothing for the map's share.
      vio_(0.75 * vehicle.estimation.position, seed + 1),
      estimated_(vio_.estimate(start, 0)) {}

FlightSample ClosedLoop::sample(const Setpoint& command, int segment) const {
  return {
      quadrotor_.time(),   segment, quadrotor_.state(), estimated_, quadrotor_.acceleration(), quadrotor_.attitude(),
      quadrotor_.thrust(), command};
}

void ClosedLoop::fly(const Setpoint& command) {
  quadrotor_.command(command);
  const int steps = static_cast<int>(std::lround(kControlPeriod / Quadrotor::kStep));
  for (int i = 0; i < steps; ++i) {
    quadrotor_.step(airflow_.step(quadrotor_.state().p_W, Quadrotor::kStep), estimated_);
    estimated_ = vio_.estimate(quadrotor_.state(), quadrotor_.time());
  }
}

std::vector<Setpoint> straight_commands(const Vec3& from_W, const Vec3& to_W, double v_max, double a_max) {
  // s(u) = 10u³ − 15u⁴ + 6u⁵: largest ds/du = 15/8, largest d²s/du² = 10/√3.
  const Vec3 way = to_W - from_W;
  const double length = way.norm();
  const double duration = std::max(1.875 * length / v_max, std::sqrt(10 / std::sqrt(3.0) * length / a_max));
  const auto steps = static_cast<std::size_t>(std::ceil(duration / kControlPeriod));
  std::vector<Setpoint> commands;
  for (std::size_t k = 1; k <= steps; ++k) {
    const double T = static_cast<double>(steps) * kControlPeriod;
    const double u = static_cast<double>(k) / static_cast<double>(steps);
    Setpoint c;
    c.p_W = from_W + way * (u * u * u * (10 + u * (-15 + 6 * u)));
    c.v_W = way * (30 * u * u * (1 + u * (-2 + u)) / T);
    c.a_W = way * (60 * u * (1 + u * (-3 + 2 * u)) / (T * T));
    commands.push_back(c);
  }
  return commands;
}

std::vector<Setpoint> hold_commands(const Vec3& at_W, double seconds) {
  Setpoint hold;
  hold.p_W = at_W;
  return std::vector<Setpoint>(static_cast<std::size_t>(std::lround(seconds / kControlPeriod)), hold);
}

log::FlightLog to_log(const std::vector<FlightSample>& samples) {
  log::FlightLog log;
  const auto add = [&](const std::string& prefix, const std::string& unit, const Vec3& value) {
    for (int axis = 0; axis < 3; ++axis) {
      log.columns[prefix + std::string("xyz")[static_cast<std::size_t>(axis)] + unit].push_back(value[axis]);
    }
  };
  for (const auto& s : samples) {
    log.t_s.push_back(s.t);
    add("", "_m", s.estimated.p_W);
    add("v", "_mps", s.estimated.v_W);
    add("a", "_mps2", s.acceleration);
    add("cmd_", "_m", s.command.p_W);
    add("cmd_v", "_mps", s.command.v_W);
    add("cmd_a", "_mps2", s.command.a_W);
    log.columns["qw"].push_back(s.attitude.w());
    log.columns["qx"].push_back(s.attitude.x());
    log.columns["qy"].push_back(s.attitude.y());
    log.columns["qz"].push_back(s.attitude.z());
    log.columns["thrust"].push_back(s.thrust);
    log.columns["segment"].push_back(s.segment);
  }
  return log;
}

}  // namespace backwash::sim

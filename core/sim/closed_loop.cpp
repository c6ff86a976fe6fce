// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "core/sim/flight.hpp"

namespace backwash::sim {

namespace {

Vehicle later(Vehicle vehicle, std::span<const SimulationTerm> terms) {
  vehicle.controller.latency = std::max(0.0, vehicle.controller.latency + setpoint_delay(terms));
  vehicle.controller.attitude_lag = std::max(0.0, vehicle.controller.attitude_lag + more_attitude_lag(terms));
  auto& c = vehicle.controller;
  const auto least = least_integrator(terms, c.kd);
  c.velocity_integrator.horizontal = std::max(c.velocity_integrator.horizontal, least.horizontal);
  c.velocity_integrator.vertical = std::max(c.velocity_integrator.vertical, least.vertical);
  return vehicle;
}

std::variant<AirflowTruth, ModelAir> air_of(const map::OccupancyGrid& grid, const Vehicle& vehicle, std::uint64_t seed,
                                            const Simulation& simulation) {
  if (simulation.air) return ModelAir(*simulation.air, seed);
  return AirflowTruth(grid, vehicle, seed, simulation.strength);
}

}  // namespace

ClosedLoop::ClosedLoop(const map::OccupancyGrid& grid, const Vehicle& vehicle, const State& start, std::uint64_t seed,
                       const Simulation& simulation)
    : quadrotor_(later(vehicle, simulation.terms), start),
      air_(air_of(grid, vehicle, seed, simulation)),
      air_terms_(grid, simulation.terms, seed + 2),
      sensors_(vehicle, simulation.terms, simulation.hover_rpm, seed + 3),
      // The sets reserve estimation.position; an estimate that used all of it would leave nothing for the map's share.
      vio_(0.75 * vehicle.estimation.position, seed + 1),
      estimated_(vio_.estimate(start, 0)) {
  quadrotor_.set_thrust_terms(ThrustTerms(simulation.terms));
}

FlightSample ClosedLoop::sample(const Setpoint& command, std::optional<int> segment) {
  return {quadrotor_.time(),
          segment,
          quadrotor_.state(),
          estimated_,
          sensors_.acceleration(quadrotor_.acceleration(), quadrotor_.yaw(), quadrotor_.time(), temperature_),
          quadrotor_.attitude(),
          quadrotor_.thrust(),
          command,
          sensors_.rotors()};
}

void ClosedLoop::set_conditions(double yaw, std::optional<double> voltage, std::optional<double> temperature) {
  quadrotor_.set_heading(yaw);
  quadrotor_.set_voltage(voltage);
  temperature_ = temperature;
}

void ClosedLoop::step() {
  const FlightInstant now{quadrotor_.time(), quadrotor_.state().p_W, quadrotor_.state().v_W, quadrotor_.yaw()};
  const auto terms = air_terms_.step(now, Quadrotor::kStep);
  const Vec3 gust = std::visit([&](auto& air) { return air.step(terms.place_W, Quadrotor::kStep, terms.gust); }, air_);
  quadrotor_.step(gust + terms.push_W, estimated_);
  sensors_.step(quadrotor_.commanded_thrust(), Quadrotor::kStep);
  estimated_ = vio_.estimate(quadrotor_.state(), quadrotor_.time());
}

void ClosedLoop::step(const Setpoint& command) {
  quadrotor_.command(command);
  step();
}

void ClosedLoop::fly(const Setpoint& command) {
  quadrotor_.command(command);
  const int steps = static_cast<int>(std::lround(kControlPeriod / Quadrotor::kStep));
  for (int i = 0; i < steps; ++i) step();
}

std::vector<Setpoint> hold_commands(const Vec3& at_W, double seconds) {
  Setpoint hold;
  hold.p_W = at_W;
  return std::vector<Setpoint>(static_cast<std::size_t>(std::lround(seconds / kControlPeriod)), hold);
}

log::FlightLog to_log(const std::vector<FlightSample>& samples, bool rotors) {
  log::FlightLog log;
  const auto add = [&](const std::string& prefix, const std::string& unit, const Vec3& value) {
    for (int axis = 0; axis < 3; ++axis)
      log.columns[std::string(prefix).append(1, "xyz"[axis]).append(unit)].push_back(value[axis]);
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
    log.columns["segment"].push_back(s.segment.value_or(-1));  // the file format's number for none
    for (std::size_t i = 0; rotors && i < 4; ++i) {
      log.columns["motor" + std::to_string(i + 1)].push_back(s.rotors.motor[i]);
      log.columns["rpm" + std::to_string(i + 1)].push_back(s.rotors.rpm[i]);
    }
  }
  return log;
}

}  // namespace backwash::sim

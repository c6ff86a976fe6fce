// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/vehicle/sensors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/types/thrust.hpp"

namespace backwash::sim {
namespace {

using Kind = SimulationTerm::Kind;

constexpr double kThrustCoefficient = 0.025, kAir = 1.2;  // kg/m³

/// How much faster each rotor of a craft turns than their mean: lines of rotors that turn exactly alike would be one.
constexpr std::array<double, 4> kBuilt = {-0.004, 0.0015, 0.004, -0.0015};

double typical_hover_rpm(const Vehicle& v) {
  const double r = v.body.rotor_radius, thrust = v.body.mass * kGravity / 4;
  const double omega = std::sqrt(thrust / (kThrustCoefficient * kAir * std::numbers::pi * r * r * r * r));
  return omega * 30 / std::numbers::pi;
}

/// Bias of the accelerometer along the heading's axes, m/s².
Vec3 bias_of(const SimulationTerm& term, double t, std::optional<double> temperature) {
  const auto& x = term.value;
  const Vec3 rate(x[0], x[1], x[2]), first(x[3], x[4], x[5]);
  if (term.is(Kind::sensor_drift_with_time)) return first + rate * (t / 100);
  return first + rate * ((temperature.value_or(x[6] + x[7] * t) - 25) / 10);
}

}  // namespace

Sensors::Sensors(const Vehicle& vehicle, std::span<const SimulationTerm> terms, std::optional<double> hover_rpm,
                 std::uint64_t seed)
    : vehicle_(vehicle), hover_rpm_(hover_rpm.value_or(typical_hover_rpm(vehicle))), rng_(seed) {
  for (const auto& term : terms) {
    if (term.is(Kind::sensor_drift_with_time) || term.is(Kind::sensor_drift_with_temperature)) terms_.push_back(term);
    for (std::size_t i = 0; i < 4; ++i) {
      if (term.is(Kind::rotor_needs)) needs_[i] += term.value[i];
      if (term.is(Kind::rotor_reading)) reads_[i] += term.value[i];
      if (term.is(Kind::rotor_dropout)) missing_[i] += term.value[i];
      if (term.is(Kind::sensor_lines)) {
        lines_[i] = std::hypot(lines_[i], term.value[i]);
        built_[i] = kBuilt[i];
      }
    }
    if (term.is(Kind::sensor_lines)) floor_ = std::max(floor_, term.value[4]);
  }
}

void Sensors::step(double thrust_acc, double dt) {
  thrust_acc_ = thrust_acc;
  const double hover = hover_rpm_ * std::sqrt(std::max(thrust_acc, 0.0) / kGravity) * std::numbers::pi / 30;
  for (std::size_t i = 0; i < 4; ++i)
    phase_[i] = std::fmod(phase_[i] + hover * (1 + built_[i]) * std::exp(0.5 * needs_[i]) * dt, 2 * std::numbers::pi);
}

Vec3 Sensors::acceleration(const Vec3& acceleration_W, double yaw, double t, std::optional<double> temperature) {
  Vec3 told = acceleration_W;
  for (const auto& term : terms_) {
    const Vec3 b = bias_of(term, t, temperature);
    told += Vec3(b.x() * std::cos(yaw) - b.y() * std::sin(yaw), b.x() * std::sin(yaw) + b.y() * std::cos(yaw), b.z());
  }
  for (std::size_t i = 0; i < 4; ++i) told.z() += lines_[i] * std::cos(phase_[i]);
  if (floor_ > 0) told += floor_ * Vec3(normal_(rng_), normal_(rng_), normal_(rng_));
  return told;
}

RotorReadings Sensors::rotors() {
  RotorReadings told{};
  const double share = vehicle_.body.mass * thrust_acc_ / vehicle_.propulsion.max_thrust;
  for (std::size_t i = 0; i < 4; ++i) {
    const double need = std::exp(needs_[i]);
    told.motor[i] = std::clamp(thrust_command(vehicle_, share * need), 0.0, 1.0);
    const bool missing = missing_[i] > 0 && std::generate_canonical<double, 53>(rng_) < missing_[i];
    const double turns = hover_rpm_ * (1 + built_[i]) * std::sqrt(thrust_acc_ / kGravity * need);
    told.rpm[i] = missing ? 0 : turns * std::exp(0.5 * reads_[i]);
  }
  return told;
}

}  // namespace backwash::sim
